"""Ends a task at its goal, at rest."""

import numpy as np

from vergence.arrays import FloatArray
from vergence.geometry import se3_compose, se3_inverse, so3_angle
from vergence.parts import knob, part
from vergence.runtime.task_ends.task_end import EndSetting, Moment, Until
from vergence.signals import Outcome, OutcomeKind


@part("task_end", "reached")
class Reached:
    """Ends the task when the features or the pose have been as desired for some time.

    A task that determines its own goal, such as `reach` or `advance`, ends there regardless of
    these tolerances.
    """

    # Largest error of every feature, for image points.
    tolerance_px: float = knob(1.0, "px", above=0, upto=1e4)
    # Largest position error, for a desired pose.
    tolerance_m: float = knob(2e-3, "m", above=0, upto=10)
    # Largest orientation error, for a desired pose.
    tolerance_deg: float = knob(0.3, "°", above=0, upto=180)
    time_s: float = knob(0.5, "s", least=0, upto=60)  # time for which this must hold

    def bind(self, setting: EndSetting) -> Until:
        """Return the monitor of the error."""
        return _Watch(self, setting)


class _Watch:
    def __init__(self, end: Reached, setting: EndSetting) -> None:
        self._end, self._camera_pose = end, setting.camera_pose
        self._since = float("nan")  # s, since when every image has been within the tolerance

    def over(self, now: Moment) -> Outcome | None:
        """Return the outcome of the task once it has ended."""
        where = self._off(now)
        if not where:
            self._since = float("nan")
        elif self._since != self._since:
            self._since = now.since_s
        if not now.since_s - self._since >= self._end.time_s:  # true of NaN as well
            return None
        return Outcome(OutcomeKind.REACHED, where, now.time)

    def _off(self, now: Moment) -> str:
        """Return the remaining error as text; empty if it exceeds the tolerance."""
        if now.reference.T_camera_target is not None:
            return self._off_pose(now, now.reference.T_camera_target)
        views = [v for v in now.observation.views if v.camera not in now.reference.elsewhere_px]
        desired = now.reference.points_px
        if not views or desired is None or views[-1].points_px.shape != desired.shape:
            return ""
        far = np.linalg.norm(views[-1].points_px - desired, axis=1).max()
        near = views[-1].found.all() and far <= self._end.tolerance_px
        return f"{far:.2g} px from the goal" if near else ""

    def _off_pose(self, now: Moment, desired: FloatArray) -> str:
        if now.observation.target is None:
            return ""
        T_camera_world = se3_inverse(self._camera_pose(now.joints))
        seen = se3_compose(T_camera_world, now.observation.target.T_world_target)
        off = se3_compose(se3_inverse(np.ascontiguousarray(desired)), seen)
        distance = float(np.linalg.norm(off[:3, 3]))
        angle = float(np.rad2deg(so3_angle(off)))
        near = distance <= self._end.tolerance_m and angle <= self._end.tolerance_deg
        return f"{1e3 * distance:.2f} mm and {angle:.2f}° from the goal" if near else ""
