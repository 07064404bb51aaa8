"""The protocol of path planners, including a user's own."""

from typing import Protocol, runtime_checkable

from vergence.planning.failure import PlanFailure
from vergence.planning.path import Path
from vergence.planning.problem import PlanningProblem


@runtime_checkable
class PathPlanner(Protocol):
    """Finds a path of joints, camera and image points."""

    def plan(self, problem: PlanningProblem) -> Path | PlanFailure:
        """Return a path from the start to the goal, or the constraint that prevents one.

        The path begins at `problem.q_start`; `Path.through` makes a path from joint waypoints.
        """
        ...
