"""Which features each camera will see, before its image is looked at.

Predicted from the poses of target and cameras alone: field of view, faces turned away, the target
in front of itself, and anything else in the way through a function that is handed in. This is what
[Lippiello2005] takes from its reference [9].
"""

from collections.abc import Callable
from enum import IntEnum
from typing import NamedTuple, TypeAlias

import numpy as np
from numba import njit
from numpy.typing import NDArray

from vergence.arrays import BoolArray, FloatArray, IntArray
from vergence.camera.lens import in_image, is_one_to_one, pixel_of
from vergence.estimation.target_shape import TOUCHING, TargetShape
from vergence.estimation.triangle_tree import TriangleTree, is_cut
from vergence.geometry import se3_inverse, transform_points

StatusArray: TypeAlias = NDArray[np.uint8]  # a `ViewStatus` each
# blocked(origin (3,), points (N, 3)) -> (N,): whether something is between them, world frame, m.
Blocked: TypeAlias = Callable[[FloatArray, FloatArray], BoolArray]


class ViewStatus(IntEnum):
    """Why a feature is or is not seen."""

    VISIBLE = 0
    BEHIND = 1  # behind the camera
    OUTSIDE = 2  # outside the image, or too near its border
    TURNED_AWAY = 3  # none of the faces around it faces the camera
    HIDDEN = 4  # behind another part of the target
    BLOCKED = 5  # behind something else


VISIBLE, BEHIND, OUTSIDE, TURNED_AWAY, HIDDEN = (
    int(s) for s in list(ViewStatus)[:5]
)  # for kernels


class Visibility(NamedTuple):
    """What every camera is expected to see of every feature."""

    status: StatusArray  # (C, M)
    points_px: FloatArray  # (C, M, 2) predicted places, px
    depth: FloatArray  # (C, M) along the optical axis, m

    @property
    def visible(self) -> BoolArray:
        """The features that are seen, (C, M)."""
        seen: BoolArray = self.status == VISIBLE
        return seen


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def faces_camera(
    origin: FloatArray, point: FloatArray, normals: FloatArray, count: int, least_cosine: float
) -> bool:
    """Return whether one of the faces around a feature faces the camera, or it has none."""
    if count == 0:
        return True
    x, y, z = origin[0] - point[0], origin[1] - point[1], origin[2] - point[2]
    least = least_cosine * np.sqrt(x * x + y * y + z * z)
    for k in range(count):
        if normals[k, 0] * x + normals[k, 1] * y + normals[k, 2] * z > least:
            return True
    return False


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def see(
    T_camera_target: FloatArray,
    lenses: FloatArray,
    points: FloatArray,
    normals: FloatArray,
    face_counts: IntArray,
    may_be_hidden: BoolArray,
    surface: TriangleTree,
    touching: float,
    margin_px: float,
    least_cosine: float,
) -> tuple[StatusArray, FloatArray, FloatArray]:
    """Return status (C, M), places (C, M, 2) and depth (C, M) without what else is in the way.

    Args:
        T_camera_target: predicted pose of the target in each camera, (C, 4, 4).
        lenses: packed cameras, (C, 11).
        points: features in the target's frame, (M, 3), m.
        normals: of the faces around each feature, (M, K, 3).
        face_counts: how many faces there are around each, (M,).
        may_be_hidden: by the surface, where one of its faces faces the camera, (M,).
        surface: of the target.
        touching: a surface this near a feature does not hide it, m.
        margin_px: how far from the border of the image a feature must be.
        least_cosine: of the angle between a face's normal and the line of sight.
    """
    cameras, features = len(T_camera_target), len(points)
    status = np.empty((cameras, features), dtype=np.uint8)
    places = np.empty((cameras, features, 2))
    depth = np.empty((cameras, features))
    for c in range(cameras):
        eye = se3_inverse(T_camera_target[c])[:3, 3].copy()
        seen, lens = transform_points(T_camera_target[c], points), lenses[c]
        for m in range(features):
            z = seen[m, 2]
            depth[c, m] = z
            if not z > 0.0:
                places[c, m] = np.nan
                status[c, m] = BEHIND
                continue
            x, y = seen[m, 0] / z, seen[m, 1] / z
            u, v = pixel_of(lens, x, y)
            places[c, m, 0], places[c, m, 1] = u, v
            if not (is_one_to_one(lens, x, y) and in_image(lens, u, v, margin_px)):
                status[c, m] = OUTSIDE
            elif not faces_camera(eye, points[m], normals[m], face_counts[m], least_cosine):
                status[c, m] = TURNED_AWAY
            elif may_be_hidden[m] and is_cut(surface, eye, points[m], touching):
                status[c, m] = HIDDEN
            else:
                status[c, m] = VISIBLE
    return status, places, depth


def predict_visibility(
    shape: TargetShape,
    T_camera_target: FloatArray,
    lenses: FloatArray,
    *,
    margin_px: float = 8.0,
    least_cosine: float = 0.1,
) -> Visibility:
    """Predict what cameras will see of a target that nothing else hides.

    Args:
        shape: the target.
        T_camera_target: its predicted pose in each camera at that camera's exposure, (C, 4, 4).
        lenses: of these cameras, (C, 11).
        margin_px: how far from the border a feature must be.
        least_cosine: a face counts as facing the camera if the cosine between its normal and the
            line of sight is above this; flatter faces show no usable corner.
    """
    return Visibility(
        *see(
            T_camera_target,
            lenses,
            shape.points,
            shape.normals,
            shape.face_counts,
            shape.may_be_hidden,
            shape.surface,
            TOUCHING * shape.size,
            margin_px,
            least_cosine,
        )
    )


def add_obstacles(
    status: StatusArray, blocked: Blocked, eye: FloatArray, points_world: FloatArray
) -> None:
    """Mark the features of one camera, (M,), that something else hides; asks only for visible ones.

    Args:
        status: of that camera, (M,); changed.
        blocked: returns what is between the eye and points.
        eye: position of the camera, (3,), m.
        points_world: the features, (M, 3), m.
    """
    visible = np.flatnonzero(status == ViewStatus.VISIBLE)
    if len(visible):
        hidden = np.asarray(blocked(eye, points_world[visible]), dtype=np.bool_)
        status[visible[hidden]] = ViewStatus.BLOCKED
