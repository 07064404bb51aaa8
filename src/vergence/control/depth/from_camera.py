"""Depth at each feature, measured by a depth camera."""

import numpy as np

from vergence.arrays import FloatArray
from vergence.control.depth.carried import CarriedSource
from vergence.control.depth.depth import Depths, MeasuredPoints
from vergence.parts import part


@part("depth", "from_camera")
class DepthFromCamera:
    """The depth that a depth camera measures at each feature.

    Where it has no value (a hole, an edge between near and far), the last depth is updated from the
    camera's motion.
    """

    @property
    def estimates_motion(self) -> bool:
        """True: every image is measured independently."""
        return True

    def bind(self, features: FloatArray | None) -> "MeasuredSource":
        """Return a source for one camera."""
        return MeasuredSource()


class MeasuredSource:
    """Uses the measured depth of each point, and updates it from the camera's motion if missing."""

    def __init__(self) -> None:
        self._carried = CarriedSource()

    def update(self, exposure: MeasuredPoints) -> Depths:
        """Return the depths at this image."""
        measured, deviation = exposure.measured_m, exposure.deviation_m
        if measured is None or deviation is None:
            return self._carried.update(exposure)
        known = exposure.found & np.isfinite(measured) & (measured > 0.0)
        depth = self._carried.carry(exposure, np.where(known, measured, np.nan))
        if not known.all():
            return Depths(depth)
        return Depths(depth, float((deviation / depth).max(initial=0.0)))
