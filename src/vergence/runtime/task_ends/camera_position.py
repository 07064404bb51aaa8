"""Ends a task at a camera position."""

import numpy as np

from vergence.parts import knob, part
from vergence.runtime.task_ends.task_end import EndSetting, Moment, Until
from vergence.signals import Outcome, OutcomeKind


@part("task_end", "pose")
class CameraPosition:
    """Ends the task when the camera, or the object that the arm holds, is near a position."""

    position_m: tuple[float, float, float] = knob(..., "m")  # x, y, z of the camera
    tolerance_m: float = knob(5e-3, "m", above=0, upto=10)  # distance at which the task ends

    def bind(self, setting: EndSetting) -> Until:
        """Return the monitor of the camera."""
        return _Watch(self, setting)


class _Watch:
    def __init__(self, end: CameraPosition, setting: EndSetting) -> None:
        self._end, self._camera_pose = end, setting.camera_pose

    def over(self, now: Moment) -> Outcome | None:
        """Return the outcome of the task once it has ended."""
        away = self._camera_pose(now.joints)[:3, 3] - np.array(self._end.position_m)
        distance = float(np.linalg.norm(away))
        if distance > self._end.tolerance_m:
            return None
        reason = f"the camera is {1e3 * distance:.1f} mm from its end position"
        return Outcome(OutcomeKind.REACHED, reason, now.time)
