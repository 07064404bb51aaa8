"""Depth updated from the camera's motion, for a stationary target."""

from typing import NamedTuple

import numpy as np
from numba import njit

from vergence.arrays import BoolArray, FloatArray
from vergence.control.depth.depth import Depths, MeasuredPoints, in_front
from vergence.geometry import se3_compose, se3_inverse, transform_points
from vergence.parts import part


@part("depth", "carried")
class CarriedDepth:
    """The depth believed at the start, updated from camera motion; needs a stationary target."""

    @property
    def estimates_motion(self) -> bool:
        """False: it is wrong for a target that moves in depth."""
        return False

    def bind(self, features: FloatArray | None) -> "CarriedSource":
        """Return a source for one camera."""
        return CarriedSource()


class CarriedPoints(NamedTuple):
    """Where the points were in the last image."""

    T_camera_scene: FloatArray  # (4, 4) at its exposure
    points: FloatArray  # (M, 3) in the camera frame, m; NaN where unknown


def nothing_carried(count: int) -> CarriedPoints:
    """Return the state before the first image."""
    return CarriedPoints(np.eye(4), np.full((count, 3), np.nan))


@njit(cache=True, error_model="numpy")
def carried_depths(
    last: CarriedPoints,
    T_camera_scene: FloatArray,
    points: FloatArray,
    found: BoolArray,
    believed_m: FloatArray,
    measured_m: FloatArray,
) -> tuple[FloatArray, CarriedPoints]:
    """Return the depths (M,) in a new image: measured ones, else those of the last image, moved on.

    Args:
        last: the image before.
        T_camera_scene: at the exposure of the new one, (4, 4).
        points: in it, normalized coordinates, (M, 2).
        found: (M,).
        believed_m: depth at the start, (M,).
        measured_m: (M,), NaN where unknown.
    """
    T_now_last = se3_compose(T_camera_scene, se3_inverse(last.T_camera_scene))
    seen = transform_points(T_now_last, last.points)
    depth_m = believed_m.copy()
    for j in range(len(seen)):
        if np.isfinite(seen[j, 2]):
            depth_m[j] = seen[j, 2]
    depth_m = in_front(depth_m, believed_m)
    for j in range(len(seen)):
        if np.isfinite(measured_m[j]):
            depth_m[j] = measured_m[j]
        if found[j]:
            seen[j, :2] = points[j] * depth_m[j]
            seen[j, 2] = depth_m[j]
    return depth_m, CarriedPoints(T_camera_scene, seen)


class CarriedSource:
    """Moves each point with the camera, from one exposure to the next."""

    def __init__(self) -> None:
        self._last: CarriedPoints | None = None

    def update(self, exposure: MeasuredPoints) -> Depths:
        """Return the depths at the last exposure, as seen from the present camera pose."""
        return Depths(self.carry(exposure, np.full(len(exposure.points), np.nan)))

    def carry(self, exposure: MeasuredPoints, measured_m: FloatArray) -> FloatArray:
        """Return depths (M,), m: measured ones where known, the others as by `update`.

        Args:
            exposure: the image.
            measured_m: depths (M,), NaN where unknown.
        """
        last = self._last or nothing_carried(len(exposure.points))
        depth_m: FloatArray
        depth_m, self._last = carried_depths(
            last, exposure.T_camera_scene, exposure.points, exposure.found,
            exposure.believed_m, measured_m,
        )  # fmt: skip
        return depth_m
