"""The last part of the approach: tracking the photograph's own points, and judging the end."""

from collections.abc import Callable

import numpy as np

from vergence.arrays import FloatArray
from vergence.estimation.displacement import Displacement
from vergence.estimation.goal_fit import GoalFit
from vergence.geometry import se3_inverse
from vergence.planning.approach.answers import Arrived, in_words
from vergence.planning.approach.arrival import GoalPoints
from vergence.planning.approach.finisher import Finisher
from vergence.planning.approach.goal import ApproachSettings, GoalImage
from vergence.planning.approach.recognition import Recognition, confirm
from vergence.signals import Frame, Outcome, OutcomeKind
from vergence.vision.matching import image_fault
from vergence.vision.tracks import Tracks

NEAR_PX = 32.0  # distance of the photograph's points from their places below which they are tracked


class Closing:
    """Tracks the photograph's points, and computes how far the camera is from its goal.

    Args:
        goal: the photograph.
        settings: see `ApproachSettings`.

    Attributes:
        points: the photograph's own points; None before it is recognised.
        begun: whether they are tracked.
        finisher: uses luminance at the very end; None before and after that.
        remark: the result of luminance, for the outcome; empty before.
        scale_deviation: relative deviation of all lengths; the smallest so far.
    """

    def __init__(self, goal: GoalImage, settings: ApproachSettings) -> None:
        self._goal, self._settings = goal, settings
        self.points: GoalPoints | None = None
        self.begun = False
        self.scale_deviation = 1.0
        self.finisher: Finisher | None = None
        self.remark = ""
        self._missed = ""  # why they could not be tracked at the last attempt

    def take(self, found: Recognition) -> None:
        """Continue with newly recognised points."""
        self.points, self.begun = GoalPoints(self._goal, found.recognised_px), False
        self.finisher = None

    def begin(self, fit: GoalFit, T_world_camera: FloatArray, frame: Frame) -> str:
        """Track the photograph's points if they are where expected; return how many, as text."""
        assert self.points is not None
        assert frame.image is not None
        self.points.learn(fit)
        T_goal_camera = se3_inverse(fit.T_world_goal) @ T_world_camera
        if self.points.shift_px(T_goal_camera) > NEAR_PX:
            return ""
        tracks = self.points.track(frame.image, frame.time, T_world_camera, T_goal_camera)
        if tracks is None:
            count = len(self.points.points_px)
            self._missed = (
                f"at the end of the path {self.points.found} of {count} points of the goal image "
                "are found where they should be"
            )
            if fault := image_fault(self._goal.image):
                self._missed += f"; it is {fault}"
            return ""
        self.begun, self._missed = True, ""
        return f"{np.count_nonzero(tracks.found)} of {len(tracks.found)}"

    def tracks(self, frame: Frame, T_world_camera: FloatArray) -> Tracks | None:
        """Return the points in an image if they are tracked; None if they are lost."""
        assert self.points is not None
        assert frame.image is not None
        tracks = self.points.track(frame.image, frame.time, T_world_camera)
        self.begun = tracks is not None
        if tracks is None or self.finisher is None:
            self.finisher = None
            return tracks
        return self.finisher.tracks(frame, tracks)

    def finish(self) -> Callable[[], Finisher] | None:
        """Return the job that prepares to go by luminance; None if that is not asked or over."""
        points = self.points
        if not self._settings.luminance or self.remark or self.finisher or points is None:
            return None
        return lambda: Finisher(points)

    def hand_back(self) -> str:
        """Go by the points again where luminance is no use; return why, or nothing."""
        if self.finisher is None or not self.finisher.fault:
            return ""
        fault, self.finisher = self.finisher.fault, None
        self.remark = f"; luminance did not help: {fault}"
        return fault

    def at_rest(self) -> Displacement | None:
        """Return the displacement of the camera from its goal, once it hardly moves."""
        assert self.points is not None
        tolerances = self._settings.tolerance_m, self._settings.tolerance_rad
        if self.finisher is not None:
            if not self.finisher.at_rest(*tolerances):
                return None
        elif not self.points.at_rest(*tolerances):
            return None
        return self.points.displacement

    def arrived(self, displacement: Displacement, frame: Frame) -> Callable[[], Arrived] | None:
        """Return the final comparison to be made, if the camera is certainly at its goal."""
        far_m, far_rad = self._at_most(displacement)
        if far_m > self._settings.tolerance_m or far_rad > self._settings.tolerance_rad:
            if self.finisher is not None:
                self.finisher.fault = "the points are not certainly within the tolerances any more"
            return None
        goal, image = self._goal, frame.image
        by = self.remark if self.finisher is None else "; finished by luminance"
        reason = self.where(displacement) + by
        assert image is not None
        return lambda: Arrived(confirm(goal, image), reason)

    def where(self, displacement: Displacement) -> str:
        """Return the displacement of the camera from its goal, as text."""
        where = in_words(displacement.distance_m, displacement.angle_rad)
        return f"{where} from the goal; certainly within {in_words(*self._at_most(displacement))}"

    def unfinished(self, time: float) -> Outcome:
        """Return the outcome of the task if its time is over."""
        displacement = self.points.displacement if self.points else None
        reason = f"out of time: {self._missed}" if self._missed else "out of time on the way"
        if self.begun and displacement is not None:
            reason = f"out of time at {self.where(displacement)}"
        return Outcome(OutcomeKind.NOT_REACHED, reason, time)

    def _at_most(self, displacement: Displacement) -> tuple[float, float]:
        """Return upper bounds on the distance, m, and angle, rad, of the camera from its goal."""
        far_m, far_rad = displacement.at_most()
        return far_m * (1.0 + 3.0 * self.scale_deviation), far_rad
