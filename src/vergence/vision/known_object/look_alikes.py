"""Rotations of an object that a search tries, and those after which it looks the same.

A box rotated by half a turn is the same box. A wedge seen from its high end, like many machined
parts, is nearly the same, and its edges are then confused.
"""

from itertools import product
from typing import NamedTuple

import numpy as np

from vergence.arrays import FloatArray
from vergence.geometry import angle_between, se3, se3_compose, se3_inverse, so3_exp, so3_log
from vergence.vision.known_object.object_model import ObjectModel

_FOLDS = (2, 3, 4, 6)  # of common symmetries
_SAME = 0.01  # relative to the object's size: edges closer than this coincide
_PLACES = 9  # compared along an edge
_APART_RAD = 0.05
_HALF_TURN_RAD = np.pi - 1e-6
_OFF_CENTRE = 0.05  # relative to the object's size: ends farther from its centre show a rotation
_OFF_LINE = 0.1  # sine of the angle between the two ends that do
_MOST_PAIRS = 600  # of ends that may take their places: more is a round object
_STEP_RAD, _NEAR_RAD = np.deg2rad(18.0), np.deg2rad(50.0)  # of nearby rotations that are tried
_AXES_APART_RAD = 0.5 * _STEP_RAD  # of an object that rotates unseen about an axis


class Turn(NamedTuple):
    """A rotation about an axis of the object."""

    T_target_turned: FloatArray  # (4, 4)
    axis: FloatArray  # (3,) unit, object's frame
    angle_deg: float

    def __str__(self) -> str:
        axis = ", ".join(f"{value:.2g}" for value in self.axis.round(3) + 0.0)
        return f"{self.angle_deg:.0f}° about ({axis})"


def turns_of(model: ObjectModel) -> list[Turn]:
    """Return the rotations about an object's centre under which it may look the same.

    Halves, thirds, quarters and sixths of a turn about the axes of its frame and about its
    principal axes, those that map a cube to itself, and those that map its own edges' ends to each
    other.
    """
    middle = centre_of(model)
    common = [
        2.0 * np.pi * k / fold * axis
        for axis, folds in _axes(model)
        for fold in folds
        for k in range(1, fold)
    ]
    turns: list[Turn] = []
    for vector in (*_between_ends(model, middle), *common):
        R = so3_exp(np.ascontiguousarray(vector))
        T = se3(R, middle - R @ middle)
        if all(angle_between(T, other.T_target_turned) > _APART_RAD for other in turns):
            angle = float(np.linalg.norm(vector))
            turns.append(Turn(T, vector / angle, float(np.rad2deg(angle))))
    return turns


def tried_turns(model: ObjectModel, free: FloatArray) -> list[FloatArray]:
    """Return the rotations T_target_turned (4, 4) that a search tries, the smallest first.

    All rotations within 50°, 18° apart, and those of `turns_of`.

    Args:
        model: the object.
        free: axes about which its rotation is not observable, (K, 3); rotations about them are
            left out.
    """
    middle = centre_of(model)
    count = int(_NEAR_RAD // _STEP_RAD)
    steps = _STEP_RAD * np.arange(-count, count + 1)
    vectors = np.array(np.meshgrid(steps, steps, steps)).reshape(3, -1).T
    angles = np.linalg.norm(vectors, axis=1)
    order = [k for k in np.argsort(angles, kind="stable") if angles[k] <= _NEAR_RAD]
    near = [so3_exp(np.ascontiguousarray(vectors[k])) for k in order]
    far = [turn.T_target_turned[:3, :3] for turn in turns_of(model)]
    tried: list[FloatArray] = []
    for R in near + far:
        if not tried or axes_apart_rad(R, np.array(tried), free).min() > _AXES_APART_RAD:
            tried.append(np.ascontiguousarray(R))
    return [se3(R, middle - R @ middle) for R in tried]


def symmetries(model: ObjectModel) -> list[Turn]:
    """Return the rotations that map the edges and vertices of an object to themselves."""
    places = _places_on_edges(model)
    return [
        turn
        for turn in turns_of(model)
        if _near_edges(model, places @ turn.T_target_turned[:3, :3].T + turn.T_target_turned[:3, 3])
    ]


def between(T: FloatArray, T_other: FloatArray) -> Turn:
    """Return the rotation of the object that turns one pose into another."""
    change = se3_compose(se3_inverse(T), T_other)
    w = so3_log(np.ascontiguousarray(change[:3, :3]))
    angle = float(np.linalg.norm(w))
    return Turn(change, w / max(angle, 1e-12), float(np.rad2deg(angle)))


def centre_of(model: ObjectModel) -> FloatArray:
    """Return the centroid (3,) of an object's edges, of its surface if it has none.

    Every rotation that maps them to themselves keeps it.
    """
    parts = model.edges if len(model.edges) else model.surface
    size = np.linalg.norm(
        parts[:, 1] - parts[:, 0]
        if len(model.edges)
        else np.cross(parts[:, 1] - parts[:, 0], parts[:, 2] - parts[:, 0]),
        axis=1,
    )
    centre: FloatArray = size @ parts.mean(axis=1) / size.sum()
    return centre


def axes_apart_rad(R: FloatArray, others: FloatArray, free: FloatArray) -> FloatArray:
    """Return the angles between an orientation and N others, as far as they show, (N,).

    Args:
        R: (3, 3).
        others: (N, 3, 3).
        free: axes of the object about which its rotation is not observable, (K, 3).
    """
    if len(free) > 1:
        return np.zeros(len(others))
    if len(free):
        cosines = (others @ free[0]) @ (R @ free[0])
    else:
        cosines = 0.5 * (np.einsum("nij,ij->n", others, R) - 1.0)
    angles: FloatArray = np.arccos(np.clip(cosines, -1.0, 1.0))
    return angles


def _axes(model: ObjectModel) -> list[tuple[FloatArray, tuple[int, ...]]]:
    """Return axes (3,) and the symmetry orders of the rotations about each."""
    centred = model.vertices - model.vertices.mean(axis=0)
    own = np.linalg.svd(centred, full_matrices=True)[2]
    axes: list[tuple[FloatArray, tuple[int, ...]]] = [(axis, _FOLDS) for axis in (*np.eye(3), *own)]
    for signs in product((-1.0, 0.0, 1.0), repeat=3):
        count = int(np.count_nonzero(signs))
        if signs > (0.0, 0.0, 0.0) and count > 1:
            axis = np.array(signs) / np.sqrt(count)
            axes.append((axis, (2,) if count == 2 else (3,)))
    return axes


def _between_ends(model: ObjectModel, middle: FloatArray) -> list[FloatArray]:
    """Return the rotation vectors (3,) that map the ends of an object's edges to such ends.

    Where two ends go determines a rotation. They are those that fewest others can take the place
    of; with many of these the object is round, and its rotation has no separate rivals.
    """
    from scipy.spatial import KDTree

    if not len(model.edges):
        return []
    ends = np.unique(model.edges.reshape(-1, 3), axis=0) - middle
    near = 2.0 * _SAME * model.size
    away = np.linalg.norm(ends, axis=1)
    alike = np.abs(away[:, None] - away) < near
    rare = np.where(away > _OFF_CENTRE * model.size, alike.sum(axis=1), len(ends) + 1)
    first = int(rare.argmin())
    aside = np.linalg.norm(np.cross(ends[first], ends), axis=1) / (away[first] * away + 1e-300)
    second = int(np.where(aside > _OFF_LINE, rare, len(ends) + 1).argmin())
    if rare[first] * rare[second] > _MOST_PAIRS or not aside[second] > _OFF_LINE:
        return []
    here, tree = _frame(ends[first], ends[second]), KDTree(ends)
    apart = np.linalg.norm(ends[first] - ends[second])
    vectors = []
    for one, other in product(ends[alike[first]], ends[alike[second]]):
        if abs(np.linalg.norm(one - other) - apart) < near:
            R = _frame(one, other) @ here.T
            vector = so3_log(R)
            if np.linalg.norm(vector) > _HALF_TURN_RAD:  # about either end of its axis
                vector *= np.sign(vector[np.argmax(np.abs(vector))])
            if np.linalg.norm(vector) > _APART_RAD and tree.query(ends @ R.T)[0].max() < near:
                vectors.append(vector)
    return vectors


def _frame(one: FloatArray, other: FloatArray) -> FloatArray:
    """Return an orientation (3, 3) that two directions determine."""
    x, z = one / np.linalg.norm(one), np.cross(one, other)
    z /= np.linalg.norm(z)
    return np.column_stack((x, np.cross(z, x), z))


def _places_on_edges(model: ObjectModel) -> FloatArray:
    share = np.linspace(0.0, 1.0, _PLACES)[:, None, None]
    places: FloatArray = (1.0 - share) * model.edges[:, 0] + share * model.edges[:, 1]
    return places.reshape(-1, 3)


def _near_edges(model: ObjectModel, places: FloatArray) -> bool:
    """Return whether all places (N, 3) lie on edges of an object."""
    start, along = model.edges[:, 0], model.edges[:, 1] - model.edges[:, 0]
    ahead = places[:, None] - start
    share = np.clip(np.einsum("nej,ej->ne", ahead, along) / np.sum(along**2, axis=1), 0.0, 1.0)
    away = np.linalg.norm(ahead - share[..., None] * along, axis=2).min(axis=1)
    return bool((away < _SAME * model.size).all())
