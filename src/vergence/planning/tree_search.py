"""Trees from the start and from the goals, for a problem whose margins are given up bit by bit."""

from functools import cached_property

import numpy as np

from vergence.arrays import FloatArray
from vergence.planning.problem import PlanningProblem
from vergence.planning.tree import connect_trees
from vergence.planning.visibility import View
from vergence.robot.inverse_kinematics import finite_range

_STEP = 0.15  # longest edge, s at full speed


class TreeSearch:
    """Searches one problem at several margins to the border of the image.

    A search that fails takes all of its samples. Where trees do not meet in the whole image they
    do not within margins either, so that is tried first, once.

    Args:
        problem: whose arm, start and ranges are searched.
        goals: goal configurations, (G, n).
        clearance: sine that a sampled posture keeps from the sides of the view.
        samples: how many, before the trees give up; 0 for no search.
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

    def waypoints(self, view: View) -> FloatArray:
        """Return waypoints (P, n) in a view from the start to one of the goals; none if (0, n)."""
        return self._connected(view) if self._meet else self._nothing

    @cached_property
    def _meet(self) -> bool:
        return len(self._connected(self._problem.view(0.0))) > 0

    @property
    def _nothing(self) -> FloatArray:
        return np.empty((0, self._problem.arm.joint_count))

    def _connected(self, view: View) -> FloatArray:
        if self._count == 0:
            return self._nothing
        arm, start = self._problem.arm, self._problem.q_start
        low, high = finite_range(arm, start)
        samples = np.random.default_rng(0).uniform(low, high, (self._count, arm.joint_count))
        path: FloatArray = connect_trees(
            arm.chain, view, self._clearance, low, high, 1.0 / arm.rate_max,
            start.copy(), self._goals, samples, _STEP,
        )  # fmt: skip
        return path
