"""The source of the depth of image points: its input and its result."""

from typing import NamedTuple, Protocol, runtime_checkable

import numpy as np
from numba import njit

from vergence.arrays import BoolArray, FloatArray
from vergence.signals import TargetState


class MeasuredPoints(NamedTuple):
    """One image of the features, as the input of a depth source."""

    time: float  # s
    points: FloatArray  # (M, 2) normalized coordinates
    found: BoolArray  # (M,)
    covariance: FloatArray  # (M, 2, 2) of the points, normalized
    T_camera_scene: FloatArray  # (4, 4) at the exposure, of the frame in which the target rests
    believed_m: FloatArray  # (M,) depth at the start
    target: TargetState | None = None  # from a filter, where one runs
    measured_m: FloatArray | None = None  # (M,) by a depth camera; NaN where unknown
    deviation_m: FloatArray | None = None  # (M,) standard deviation of measured_m


class Depths(NamedTuple):
    """Depth of the features at an exposure."""

    depth_m: FloatArray  # (M,)
    share: float = float("nan")  # largest relative standard deviation; NaN if unknown


class DepthSource(Protocol):
    """Tracks the depth of one camera's features from image to image."""

    def update(self, exposure: MeasuredPoints) -> Depths:
        """Process an image and return the depths at its exposure."""
        ...


@runtime_checkable
class Depth(Protocol):
    """A method of obtaining depth, as a cell file declares it."""

    @property
    def estimates_motion(self) -> bool:
        """Whether it is right for a target that moves in depth, so its flow can be fed forward."""
        ...

    def bind(self, features: FloatArray | None) -> DepthSource:
        """Return a source for one camera.

        Args:
            features: in the target's frame, (M, 3), m; None if unknown.

        Raises:
            InputError: if the method needs something that is unknown.
        """
        ...


@njit(cache=True, error_model="numpy")
def in_front(depth_m: FloatArray, believed_m: FloatArray) -> FloatArray:
    """Return depths (M,) limited from below, to keep them in front of the camera."""
    kept = np.empty(len(depth_m))
    for j in range(len(depth_m)):
        least = 0.1 * believed_m[j]
        kept[j] = max(depth_m[j], least) if np.isfinite(depth_m[j]) else least
    return kept
