"""What one step of the tracking loop knows of its images."""

from typing import NamedTuple

from vergence.arrays import FloatArray, IntArray
from vergence.signals import Frame


class Expected(NamedTuple):
    """The prediction at an exposure."""

    T_world_target: FloatArray  # (4, 4) predicted
    covariance: FloatArray  # (12, 12) of the prediction
    doubt: float  # fraction of recent points that disagreed
    certain: bool  # whether the filter is consistent


class Predicted(NamedTuple):
    """The C images of a tick, in order of exposure, with their predictions."""

    frames: tuple[Frame, ...]
    numbers: IntArray  # (C,) indices of their cameras in the rig
    T_world_camera: FloatArray  # (C, 4, 4)
    T_camera_world: FloatArray  # (C, 4, 4)
    T_world_target: FloatArray  # (C, 4, 4) predicted for each exposure
    T_camera_target: FloatArray  # (C, 4, 4)
    expected: tuple[Expected, ...]  # at each of E times of exposure, in their order
    exposures: IntArray  # (C,) number of each image's

    @property
    def newest(self) -> Expected:
        """The prediction for the last image."""
        return self.expected[-1]
