"""Trees from the start and from the goals, for a problem whose margins are reduced step by step."""

from functools import cached_property

import numpy as np

from vergence.arrays import FloatArray
from vergence.planning.problem import PlanningProblem
from vergence.planning.tree import connect_trees
from vergence.robot.inverse_kinematics import finite_range

_STEP = 0.15  # longest edge, s at full speed


class TreeSearch:
    """Searches one problem at several margins to the border of the image.

    A failing search uses up all its samples. Trees that do not meet in the whole image do not meet
    within margins either, so that is tried first, once.

    Args:
        problem: with arm, start and ranges.
        goals: goal configurations, (G, n).
        clearance: sine that a sampled posture keeps from the sides of the view.
        samples: number of samples before the trees give up; 0 for no search.
    """

    def __init__(
        self,
        problem: PlanningProblem,
        goals: FloatArray,
        clearance: float,
        samples: int,
    ) -> None:
        self._problem, self._goals = problem, goals
        self._clearance, self._count = clearance, samples

    def waypoints(self, margin_px: float) -> FloatArray:
        """Return waypoints (P, n) from the start to one of the goals; (0, n) if there are none.

        Args:
            margin_px: to the border of the image.
        """
        whole = self._in_whole_image
        return self._connected(margin_px) if len(whole) and margin_px > 0.0 else whole

    @cached_property
    def _in_whole_image(self) -> FloatArray:
        return self._connected(0.0)

    def _connected(self, margin_px: float) -> FloatArray:
        arm, start = self._problem.arm, self._problem.q_start
        if self._count == 0:
            return np.empty((0, arm.joint_count))
        low, high = finite_range(arm, start)
        samples = np.random.default_rng(0).uniform(low, high, (self._count, arm.joint_count))
        view = self._problem.view(margin_px)
        path: FloatArray = connect_trees(
            arm.chain, view, self._clearance, low, high, 1.0 / arm.rate_max,
            start.copy(), self._goals, samples, _STEP,
        )  # fmt: skip
        return path
