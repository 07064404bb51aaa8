"""One run along a line, as the first paper's figures show it."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from vergence.arrays import FloatArray
from vergence.runtime.results import ArmTrace, CameraTrace, Run, largest
from vergence.signals import Outcome


@dataclass(frozen=True)
class Trial:
    """One run, a row for each image of the task's camera."""

    run: Run

    @property
    def outcome(self) -> Outcome:
        """How it ended."""
        return self.run.outcome

    @property
    def summary(self) -> Mapping[str, float]:
        """The run's summary."""
        return self.run.summary

    @cached_property
    def camera(self) -> CameraTrace:
        """What the camera saw."""
        return self.run.cameras[self.run.info.task_camera]

    @cached_property
    def arm(self) -> ArmTrace:
        """What the arm did in the ticks that brought an image."""
        (arm,) = self.run.arms.values()
        return arm.at(np.searchsorted(arm.time, self.camera.received))

    @property
    def error_px(self) -> FloatArray:
        """Distance of the farthest feature from where it should be, (K,)."""
        return largest(self.camera.error_px)

    @property
    def drift_px(self) -> FloatArray:
        """Distance of the farthest visible feature from where it truly is, (K,)."""
        return largest(np.where(self.camera.visible, self.camera.drift_px, np.nan))

    @property
    def camera_m(self) -> FloatArray:
        """Camera translation along the motion, (K,)."""
        return _travel(self.camera.T_world_camera)

    @property
    def object_m(self) -> FloatArray:
        """Object translation along the motion, (K,)."""
        return _travel(self.camera.T_world_target)

    @property
    def estimated_m(self) -> FloatArray:
        """Object translation as the arm knows it: x + z tan θ, (K,).

        [Nelson1995] eq. (32) prints z / cos θ, which is metres off at large tilt.
        """
        T = self.camera.T_world_camera
        height = T[:, 2, 3] - self.camera.T_world_target[:, 2, 3]
        tilt = np.arctan2(T[:, 0, 2], -T[:, 2, 2])
        return self.camera_m + height * np.tan(tilt)


def _travel(T: FloatArray) -> FloatArray:
    along_x: FloatArray = T[:, 0, 3] - T[0, 0, 3]
    return along_x


Trials = Mapping[tuple[str, int], Trial]  # by strategy and direction, 1 or -1
