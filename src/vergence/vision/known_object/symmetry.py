"""Axes about which an object can rotate without any change of its outline.

No image of its outline shows such a rotation. The axes are found by trial rather than from the
mesh: the outline is rendered at several rotations about each candidate axis.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from vergence.arrays import BoolArray, FloatArray, frozen
from vergence.geometry import se3, se3_compose, so3_exp
from vergence.vision.known_object.look_alikes import Turn, axes_apart_rad
from vergence.vision.known_object.object_model import ObjectModel
from vergence.vision.known_object.silhouette import Grid, draw_nearness, project_vertices

_CELLS = 200  # along a side of the mask
_DISTANCE = 5.0  # of the camera, in multiples of the object's size
_TURNS_RAD = (0.41, 1.13, 1.83, 2.62, 3.9)
_SLANTS_RAD = (0.5, 1.2)  # between an axis and the line of sight
_VIEWS_RAD = ((0.5, 0.3, 0.0), (1.3, 0.2, 0.4), (0.4, 1.2, -0.5), (2.2, 0.5, 0.6))
_SHOWN_RAD = 0.05  # rotations smaller than this are about a free axis


class FreeAxes(NamedTuple):
    """Axes about which rotation is unobservable, in the object's frame."""

    axes: FloatArray  # (K, 3) unit vectors, K = 0 (none), 1 (a can) or 3 (a ball)
    centre: FloatArray  # (3,) m, on all of them

    def motions(self, T: FloatArray) -> FloatArray:
        """Return the unobservable motions (δp, δθ) along camera axes, (6, K), m and rad.

        Args:
            T: pose of the object in the camera, (4, 4).
        """
        turns = self.axes @ T[:3, :3].T
        moved = np.cross(turns, -(T[:3, :3] @ self.centre))
        return np.vstack((moved.T, turns.T))

    def __str__(self) -> str:
        if not len(self.axes):
            return ""
        if len(self.axes) == 3:
            return "its outline shows none of its rotations"
        axis = ", ".join(f"{value:.2g}" for value in self.axes[0].round(3) + 0.0)
        return f"its outline does not show rotation about its axis ({axis})"


def free_axes(model: ObjectModel) -> FreeAxes:
    """Return the axes about which an object can rotate without a change of its outline."""
    centre, principal = _principal_axes(model)
    closed = model.closed
    candidates = [*principal.T, *np.eye(3)]
    free: list[FloatArray] = []
    for axis in candidates:
        new = all(abs(float(axis @ other)) < 0.99 for other in free)
        if new and _turns_unseen(model, closed, centre, axis):
            free.append(axis)
    if len(free) > 1:  # about two axes implies about all
        free = list(np.eye(3))
    axes = np.array(free, dtype=np.float64).reshape(-1, 3)
    return FreeAxes(frozen(axes), frozen(centre))


def symmetric_turns(model: ObjectModel, axes: FreeAxes, turns: Sequence[Turn]) -> list[Turn]:
    """Return those of some rotations that leave an object's outline unchanged.

    Args:
        model: the object.
        axes: about which its rotation is not observable; rotations about them are left out.
        turns: the rotations.
    """
    closed, known, same = model.closed, [np.eye(3)], []
    for turn in turns:
        R = turn.T_target_turned[:3, :3]
        if axes_apart_rad(R, np.array(known), axes.axes).min() < _SHOWN_RAD:
            continue
        if _looks_same(model, closed, axes.centre, turn.T_target_turned):
            same.append(turn)
            known.append(R)
    return same


def _looks_same(model: ObjectModel, closed: bool, centre: FloatArray, S: FloatArray) -> bool:
    for view in _VIEWS_RAD:
        R = so3_exp(np.array(view))
        T = se3(R, np.array((0.0, 0.0, _DISTANCE * model.size)) - R @ centre)
        if _differ(_mask(model, closed, T), _mask(model, closed, se3_compose(T, S))):
            return False
    return True


def _principal_axes(model: ObjectModel) -> tuple[FloatArray, FloatArray]:
    """Return the centroid (3,) of the surface and its principal axes, columns of (3, 3)."""
    a, b, c = (model.surface[:, k] for k in range(3))
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    middles = np.concatenate((a + b, b + c, c + a)) / 2.0  # exact for second moments
    weights = np.tile(area, 3) / (3.0 * area.sum())
    centre = weights @ middles
    spread = (middles - centre).T @ (weights[:, None] * (middles - centre))
    return centre, np.ascontiguousarray(np.linalg.eigh(spread)[1])


def _turns_unseen(model: ObjectModel, closed: bool, centre: FloatArray, axis: FloatArray) -> bool:
    for slant in _SLANTS_RAD:
        R = _upright(axis, slant)
        T = se3(R, np.array((0.0, 0.0, _DISTANCE * model.size)) - R @ centre)
        first = _mask(model, closed, T)
        for angle in _TURNS_RAD:
            turn = so3_exp(np.ascontiguousarray(angle * axis))
            turned = se3_compose(T, se3(turn, centre - turn @ centre))
            if _differ(first, _mask(model, closed, turned)):
                return False
    return True


def _upright(axis: FloatArray, slant: float) -> FloatArray:
    """Return a rotation that brings the axis to an angle from the optical axis, (3, 3)."""
    aside = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
    aside /= np.linalg.norm(aside)
    own = np.array((aside, np.cross(axis, aside), axis))  # maps the axis to z
    R: FloatArray = np.ascontiguousarray(so3_exp(np.array((slant, 0.0, 0.0))) @ own)
    return R


def _mask(model: ObjectModel, closed: bool, T: FloatArray) -> BoolArray:
    projected = np.empty((len(model.vertices), 3))
    project_vertices(T, model.vertices, projected, np.empty(4))
    half = 0.7 / _DISTANCE
    grid = Grid(-half, -half, 2.0 * half / (_CELLS - 1), _CELLS, _CELLS)
    mask: BoolArray = draw_nearness(projected, model.triangles, grid, closed) > 0.0
    return mask


def _differ(one: BoolArray, other: BoolArray) -> bool:
    """Return whether two masks differ over three cells in width somewhere."""
    import cv2

    different = (one != other).view(np.uint8)
    return bool(cv2.erode(different, np.ones((3, 3), np.uint8)).any())
