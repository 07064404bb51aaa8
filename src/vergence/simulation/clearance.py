"""How far the bodies of an arm are from each other and from what is around them."""

from collections.abc import Callable, Mapping
from copy import copy
from typing import TYPE_CHECKING, Any, NamedTuple

import mujoco
import numpy as np

from vergence.arrays import BoolArray, FloatArray, IntArray
from vergence.robot import NearPairs
from vergence.robot.chain import Chain, joint_columns
from vergence.robot.distance_gradient import distance_gradients
from vergence.signals import JointState
from vergence.simulation.collision_pairs import KINDS, collision_pairs, moved_by, name_of
from vergence.simulation.geom_distance import near_distances

if TYPE_CHECKING:
    from vergence.simulation.cell_model import CellModel

NEAR_M = 0.2  # farther pairs are not looked at
_SLIDE, _PLANE = mujoco.mjtJoint.mjJNT_SLIDE, mujoco.mjtGeom.mjGEOM_PLANE
_NONE = np.empty(0)
_ANYWHERE_M = 10.0  # how far a sliding joint without limits may go


class _Axes(NamedTuple):
    """The axes of one arm, as the kernels have them."""

    joints: IntArray  # (m,) MuJoCo's numbers
    sliding: BoolArray  # (m,)
    moves: BoolArray  # (m, B) which bodies each moves
    chain: Chain
    joint_count: int  # of the joints that may be commanded


class _Measured(NamedTuple):
    """Pairs of shapes that may be near."""

    pair: IntArray  # (K,)
    ends: FloatArray  # (K, 6) their nearest points
    distance: FloatArray  # (K,) m


class CellClearance:
    """Distances between the convex hulls of an arm's shapes, and from them to those around.

    It knows what the cell's file and models say, and joint positions; see `Clearance`.

    Attributes:
        geoms: both shapes of each pair, numbered as the model has them, (P, 2).
        colliding: names of the pairs that collide at the start, and how deep; no pairs of `geoms`.

    Args:
        model: of the cell, its arms at their start; its state is copied.
        arm: that moves.
        avoid: what it must not touch, see `collision_pairs`.
        margin_m: the distance to keep.
        states: gives the joints of all arms now, by name; they stay at their start if None.
    """

    def __init__(
        self,
        model: "CellModel",
        arm: str,
        avoid: tuple[str, ...],
        margin_m: float,
        states: Callable[[], Mapping[str, JointState]] | None = None,
    ) -> None:
        self._model, self._data, self._arm = model, copy(model.data), arm
        pairs = collision_pairs(model, arm, avoid, margin_m)
        self.geoms, self._kind, self.margin, self.colliding = pairs
        m = model.model
        self._bodies = np.asarray(m.geom_bodyid[self.geoms], dtype=np.int64).reshape(-1, 2)
        self._radius = np.where(m.geom_type == _PLANE, -1.0, m.geom_rbound)
        others = [name for name in model.arms if name != arm and "arms" in avoid]
        self._axes = {name: _axes(model, name) for name in (arm, *others)}
        self._states = states if others else None
        self._q = _NONE  # of the arm, as it was placed last among things that do not move
        self._measured: _Measured | None = None  # there
        moving = [self._axes[name] for name in others] if states else []
        self.reach = _reach(m, self._axes[arm], self.geoms)
        by_joint = [_reach(m, axes, self.geoms) for axes in moving]
        self.reach_of_others = np.hstack([np.empty((len(self.geoms), 0)), *by_joint])

    def twin(self) -> "CellClearance":
        """Return the same with a state of its own, for another thread."""
        other = copy(self)
        other._data, other._q, other._measured = copy(self._data), _NONE, None
        return other

    def near(self, q: FloatArray) -> NearPairs:
        """Return the pairs that may be less than `NEAR_M` apart with the joints at q (n,)."""
        states = self._place(q)
        pair, ends, distance = self._measure()
        drift = np.zeros(len(pair))
        for name, state in states.items():
            if state.velocity.any():
                drift += self._gradient(name, pair, ends, distance) @ state.velocity
        gradient = self._gradient(self._arm, pair, ends, distance)
        return NearPairs(distance, self.margin[pair], gradient, drift, pair)

    def distances(self, q: FloatArray) -> FloatArray:
        """Return the distance of every pair, (P,), m; `NEAR_M` for those farther apart."""
        self._place(q)
        pair, _, distance = self._measure()
        every = np.full(len(self.geoms), NEAR_M)
        every[pair] = distance
        return every

    def least(self, near: NearPairs) -> dict[str, float]:
        """Return the least distance, m, to each kind of thing that is near."""
        least: dict[str, float] = {}
        kinds = self._kind[near.pair].tolist()
        for kind, distance in zip(kinds, near.distance.tolist(), strict=True):
            if distance < least.get(KINDS[kind], NEAR_M):
                least[KINDS[kind]] = distance
        return least

    def name(self, pair: int) -> str:
        """Return the names of the two bodies of a pair."""
        first, second = (name_of(self._model.model, int(geom)) for geom in self.geoms[pair])
        return f"{first} and {second}"

    def others(self) -> FloatArray:
        """Return the joint positions of the other arms that are looked at, (k,), rad or m."""
        states = self._others().values()
        return np.concatenate([state.position for state in states]) if states else _NONE

    def _others(self) -> Mapping[str, JointState]:
        if self._states is None:
            return {}
        now = self._states()
        return {name: now[name] for name in self._axes if name != self._arm}

    def _place(self, q: FloatArray) -> Mapping[str, JointState]:
        """Put the arms where they are; return the states of the others."""
        if self._states is None and q.tobytes() == self._q.tobytes():
            return {}
        states = self._others()
        self._q, self._measured = np.array(q), None
        for name, state in states.items():
            self._model.write_position(self._data, name, state.position)
        self._model.write_position(self._data, self._arm, q)
        mujoco.mj_kinematics(self._model.model, self._data)
        return states

    def _measure(self) -> _Measured:
        """Return how near the pairs are that may be near."""
        if self._measured is None:
            m, data = self._model.model, self._data
            self._measured = _Measured(*near_distances(m, data, self.geoms, self._radius, NEAR_M))
        return self._measured

    def _gradient(
        self, arm: str, pair: IntArray, ends: FloatArray, distance: FloatArray
    ) -> FloatArray:
        axes, data = self._axes[arm], self._data
        gradient: FloatArray = distance_gradients(
            ends, distance, pair, self._bodies, axes.joints, axes.moves, axes.sliding,
            data.xaxis, data.xanchor,
        )  # fmt: skip
        if len(axes.chain.coupling):
            gradient = joint_columns(axes.chain, gradient, axes.joint_count)
        return gradient


def _axes(model: "CellModel", arm: str) -> _Axes:
    joints = model.axes_of(arm)
    sliding = model.model.jnt_type[joints] == _SLIDE
    own = model.arms[arm]
    return _Axes(
        np.array(joints), sliding, moved_by(model.model, joints), own.chain, own.joint_count
    )


def _reach(m: Any, axes: _Axes, geoms: IntArray) -> FloatArray:
    """Return what each joint changes the distance of each pair by at most, (P, n), m/rad or 1.

    A turning joint moves a body by at most the length of all that lies between them, stretched.
    """
    by_axis = np.zeros((len(geoms), len(axes.joints)))
    for p, pair in enumerate(geoms):
        for i, joint in enumerate(axes.joints):
            moved = [int(geom) for geom in pair if axes.moves[i, m.geom_bodyid[geom]]]
            if len(moved) == 1:
                by_axis[p, i] = 1.0 if axes.sliding[i] else _lever(m, int(joint), moved[0])
    chain = axes.chain
    if len(chain.coupling):
        chain = chain._replace(coupling=np.abs(chain.coupling))
    reach: FloatArray = joint_columns(chain, by_axis, axes.joint_count)
    return reach


def _lever(m: Any, joint: int, geom: int) -> float:
    """Return how far from a joint's axis any point of a shape that it moves can be, m."""
    body, first = int(m.geom_bodyid[geom]), int(m.jnt_bodyid[joint])
    length = float(np.linalg.norm(m.geom_pos[geom]) + m.geom_rbound[geom])
    while True:
        for own in range(m.body_jntadr[body], m.body_jntadr[body] + m.body_jntnum[body]):
            length += 2.0 * float(np.linalg.norm(m.jnt_pos[own]))
            if m.jnt_type[own] == _SLIDE:
                limits = m.jnt_range[own] - m.qpos0[m.jnt_qposadr[own]]
                length += float(np.abs(limits).max()) if m.jnt_limited[own] else _ANYWHERE_M
        if body == first:
            return length
        length += float(np.linalg.norm(m.body_pos[body]))
        body = int(m.body_parentid[body])
