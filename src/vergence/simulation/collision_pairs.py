"""Which shapes of a cell an arm must not bring together."""

import logging
from collections.abc import Iterator
from copy import copy
from itertools import combinations
from typing import TYPE_CHECKING, Any, NamedTuple

import mujoco
import numpy as np

from vergence.arrays import BoolArray, FloatArray, IntArray
from vergence.robot.mujoco_coupling import joints_above
from vergence.simulation.build import HULL_BITS

if TYPE_CHECKING:
    from vergence.simulation.cell_model import CellModel

_LOG = logging.getLogger(__name__)
KINDS = ("self", "arms", "fixtures", "target")
_POSTURES = 16
_UNKNOWN = (mujoco.mjtGeom.mjGEOM_HFIELD, mujoco.mjtGeom.mjGEOM_SDF)  # distances are not known


class CollisionPairs(NamedTuple):
    """Pairs of shapes, numbered as the model has them."""

    geoms: IntArray  # (P, 2)
    kind: IntArray  # (P,) which of `KINDS`
    margin: FloatArray  # (P,) m, the distance that is kept
    colliding: tuple[str, ...]  # left out, as they collide now: their names, and how deep


def collision_pairs(
    model: "CellModel", arm: str, avoid: tuple[str, ...], margin_m: float
) -> CollisionPairs:
    """Return the pairs of shapes that an arm can bring together, with the arms as they are now.

    Links that one joint connects are neighbours and no pair. Neither are shapes that overlap
    already. By up to the margin, or in most postures of the arm, that is because models are wider
    than the things; otherwise they collide. A pair that is nearer than twice the margin keeps half
    its distance.

    Args:
        model: of the cell, its arms at their start.
        arm: that moves.
        avoid: some of `KINDS`.
        margin_m: between all other pairs.
    """
    found = [pair for pair in _pairs(model, arm) if KINDS[pair[2]] in avoid]
    geoms = np.array([pair[:2] for pair in found], dtype=np.int64).reshape(-1, 2)
    kinds = np.array([pair[2] for pair in found], dtype=np.int64)
    far = 2.0 * margin_m
    distance = np.array([_distance(model, pair, far) for pair in geoms])
    apart = distance > 0.0
    colliding = []
    for pair, depth, kind in zip(geoms[~apart], -distance[~apart], kinds[~apart], strict=True):
        names = [name_of(model.model, int(geom)) for geom in pair]
        if depth > margin_m and not _mostly_overlap(model, arm, pair):
            colliding.append(f"{names[0]} and {names[1]} overlap by {1e3 * depth:.0f} mm")
        elif kind > 0:
            _LOG.warning(
                "%s overlaps %s at the start: collisions between them are not avoided", *names
            )
    margin = np.minimum(margin_m, 0.5 * distance[apart])
    return CollisionPairs(geoms[apart], kinds[apart], margin, tuple(colliding))


def name_of(model: Any, geom: int) -> str:
    """Return the name of a shape, or of its body if it has none."""
    return str(model.geom(geom).name or model.body(model.geom_bodyid[geom]).name)


def moved_by(model: Any, joints: list[int]) -> BoolArray:
    """Return which bodies each joint moves, (m, B)."""
    moves = np.zeros((len(joints), model.nbody), dtype=np.bool_)
    for body in range(model.nbody):
        above = set(joints_above(model, body))
        moves[:, body] = [joint in above for joint in joints]
    return moves


def _pairs(model: "CellModel", arm: str) -> Iterator[tuple[int, int, int]]:
    """Yield pairs of shapes that the arm moves against each other, and which of `KINDS`."""
    m = model.model
    moves = moved_by(m, model.axes_of(arm))
    own = model.bodies_of(arm)
    arms = frozenset[int]().union(*(model.bodies_of(name) for name in model.arms))

    def kind_of(body: int) -> str:
        if body in own:  # what the arm holds is a part of it
            return "self"
        if model.target_of(body) is not None:
            return "target"
        return "arms" if body in arms else "fixtures"

    for a, b in combinations(_shapes(model), 2):
        bodies = int(m.geom_bodyid[a]), int(m.geom_bodyid[b])
        if (moves[:, bodies[0]] == moves[:, bodies[1]]).all():
            continue
        kinds = {kind_of(body) for body in bodies}
        if kinds == {"self"} and _neighbours(m, *bodies):
            continue
        kind = "self" if kinds == {"self"} else (kinds - {"self"}).pop()
        yield a, b, KINDS.index(kind)


def _shapes(model: "CellModel") -> list[int]:
    """Return the shapes that can be touched.

    Where any shape of a file is made for contacts, these count, else those that are seen.
    """
    m = model.model
    hull_only = (m.geom_contype == HULL_BITS[0]) & (m.geom_conaffinity == HULL_BITS[1])
    contact = ((m.geom_contype | m.geom_conaffinity) != 0) & ~hull_only
    owner = [m.body(body).name.partition("/")[0] for body in m.geom_bodyid]
    with_contacts = {owner[geom] for geom in np.flatnonzero(contact)}
    balls = {f"{camera}/ball" for camera in model.cameras}
    return [
        geom
        for geom in range(m.ngeom)
        if mujoco.mjtGeom(int(m.geom_type[geom])) not in _UNKNOWN
        and (
            m.geom(geom).name in balls
            or (contact[geom] if owner[geom] in with_contacts else m.geom_rgba[geom, 3] > 0.0)
        )
    ]


def _neighbours(m: Any, a: int, b: int) -> bool:
    """Return whether one joint, or none, lies between two bodies."""
    a, b = int(m.body_weldid[a]), int(m.body_weldid[b])
    above_a, above_b = (int(m.body_weldid[m.body_parentid[body]]) for body in (a, b))
    return a == b or above_a == b or above_b == a


def _mostly_overlap(model: "CellModel", arm: str, pair: IntArray) -> bool:
    """Return whether two shapes overlap in most postures of the arm, drawn from all."""
    data, axes, rng = copy(model.data), model.arms[arm], np.random.default_rng(0)
    low, high = np.maximum(axes.q_min, -np.pi), np.minimum(axes.q_max, np.pi)
    overlaps = 0
    for q in rng.uniform(low, high, (_POSTURES, len(low))):
        model.write_position(data, arm, q)
        mujoco.mj_kinematics(model.model, data)
        overlaps += mujoco.mj_geomDistance(model.model, data, *pair, 1.0, None) <= 0.0
    return 2 * overlaps > _POSTURES


def _distance(model: "CellModel", pair: IntArray, far: float) -> float:
    return float(mujoco.mj_geomDistance(model.model, model.data, pair[0], pair[1], far, None))
