"""Jobs of an approach that take longer than an image: recognising the photograph, and planning."""

from collections.abc import Callable

import numpy as np

from vergence.arrays import FloatArray
from vergence.estimation.goal_fit import GoalFit, Prior
from vergence.geometry import pose_difference
from vergence.planning.approach.answers import Answer
from vergence.planning.approach.goal import ApproachSettings, GoalImage
from vergence.planning.approach.recognition import (
    KNOWN,
    ROUGH,
    ROUGH_M,
    UNKNOWN,
    Recognition,
    length_ratio,
    recognise,
)
from vergence.planning.failure import PlanFailure
from vergence.planning.path import Path
from vergence.planning.problem import PlanningProblem
from vergence.robot import Arm
from vergence.signals import Frame
from vergence.vision import TwoViewFailure

Plan = Callable[[PlanningProblem], Path | PlanFailure]

_CONTRADICTION = 22.5  # χ² with 6 degrees of freedom, one in a thousand
_OFF, _OFF_M, _OFF_RAD = 0.1, 3e-3, 0.02  # fraction of the path left, and lengths, to replan


class Search:
    """Searches for a photograph in an image and plans the path to where it was taken.

    It has no state, so it can run in another thread than the loop.

    Args:
        goal: the photograph.
        carrier: name of the arm that carries the camera.
        arm: that arm, up to the camera.
        plan: finds a path.
        settings: see `ApproachSettings`.
    """

    def __init__(
        self, goal: GoalImage, carrier: str, arm: Arm, plan: Plan, settings: ApproachSettings
    ) -> None:
        self._goal, self._carrier, self._arm = goal, carrier, arm
        self._plan, self._settings = plan, settings

    def camera_pose(self, frame: Frame) -> FloatArray:
        """Return T_world_camera (4, 4) at the exposure of an image."""
        return self._arm.forward_kinematics(frame.joints[self._carrier])

    def first(self, frame: Frame) -> Answer | PlanFailure | TwoViewFailure:
        """Recognise the photograph from the start and plan, or return why not."""
        settings, T = self._settings, self.camera_pose(frame)
        deviation = UNKNOWN if settings.distance_m is None else ROUGH
        prior = Prior(np.array([settings.distance_m or ROUGH_M]), deviation)
        assert frame.image is not None
        found = recognise(self._goal, frame.image, T, settings.points, prior)
        if isinstance(found, Recognition) and settings.length is not None:
            assert prior.depth_m is not None
            ratio = length_ratio(settings.length, self._goal, found.fit)
            prior = Prior(ratio * prior.depth_m, KNOWN)
            found = recognise(self._goal, frame.image, T, settings.points, prior)
        if isinstance(found, TwoViewFailure):
            return found
        path = self._plan(self._problem(found.fit, frame))
        return path if isinstance(path, PlanFailure) else Answer(found, path, True)

    def again(self, known: Recognition, frame: Frame, T_world_goal: FloatArray) -> Answer:
        """Search for the photograph again.

        Args:
            known: the present recognition.
            frame: the image to search.
            T_world_goal: end pose of the path being followed, (4, 4).
        """
        assert frame.image is not None
        known = known.fitted()
        prior = known.prior
        if prior.depth_m is None:
            prior = Prior(np.array([1.0]), UNKNOWN)
        T, count = self.camera_pose(frame), self._settings.points
        found = recognise(self._goal, frame.image, T, count, prior, known.fit)
        if isinstance(found, TwoViewFailure):
            return Answer(found, None, False)
        return self.checked(found, frame, T_world_goal, True)

    def checked(
        self, known: Recognition, frame: Frame, T_world_goal: FloatArray, new_points: bool
    ) -> Answer:
        """Replan if the path leads elsewhere, or other points are tracked."""
        if not (new_points or self._contradicted(known, frame, T_world_goal)):
            return Answer(known, None, False)
        return Answer(known, self._plan(self._problem(known.fit, frame)), new_points)

    def _contradicted(self, known: Recognition, frame: Frame, T_world_goal: FloatArray) -> bool:
        fit = known.fit
        off = pose_difference(fit.T_world_goal, T_world_goal)
        sure = off @ np.linalg.solve(fit.covariance, off) > _CONTRADICTION
        rest = float(np.linalg.norm(fit.T_world_goal[:3, 3] - self.camera_pose(frame)[:3, 3]))
        far = float(np.linalg.norm(off[:3])) > max(_OFF * rest, _OFF_M)
        return bool(sure and (far or np.linalg.norm(off[3:]) > _OFF_RAD))

    def _problem(self, fit: GoalFit, frame: Frame) -> PlanningProblem:
        return PlanningProblem(
            self._arm,
            self._goal.camera,
            frame.joints[self._carrier],
            fit.T_world_goal,
            fit.points_world,
            self._settings.margin_px,
            self._settings.margin_joint,
        )
