"""Depth updated from the camera's motion, for a stationary target."""

import numpy as np

from vergence.arrays import FloatArray
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


class CarriedSource:
    """Moves each point with the camera, from one exposure to the next."""

    def __init__(self) -> None:
        self._last: tuple[FloatArray, FloatArray] | None = None  # T_camera_scene, points (M, 3)

    def update(self, exposure: MeasuredPoints) -> Depths:
        """Return the depths at the last exposure, as seen from the present camera pose."""
        return Depths(self.carry(exposure, np.full(len(exposure.points), np.nan)))

    def carry(self, exposure: MeasuredPoints, measured_m: FloatArray) -> FloatArray:
        """Return depths (M,), m: measured ones where known, the others as by `update`.

        Args:
            exposure: the image.
            measured_m: depths (M,), NaN where unknown.
        """
        depth = exposure.believed_m
        carried = np.full((len(depth), 3), np.nan)
        if self._last is not None:
            T, points = self._last
            carried = transform_points(se3_compose(exposure.T_camera_scene, se3_inverse(T)), points)
            known = np.isfinite(carried[:, 2])
            depth = in_front(np.where(known, carried[:, 2], depth), exposure.believed_m)
        depth = np.where(np.isfinite(measured_m), measured_m, depth)
        seen = np.column_stack((exposure.points * depth[:, None], depth))
        self._last = exposure.T_camera_scene, np.where(exposure.found[:, None], seen, carried)
        return depth
