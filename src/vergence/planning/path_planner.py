"""What a planner of a user's own must offer."""

from typing import Protocol, runtime_checkable

from vergence.planning.failure import PlanFailure
from vergence.planning.path import Path
from vergence.planning.problem import PlanningProblem


@runtime_checkable
class PathPlanner(Protocol):
    """Finds where joints, camera and image points go."""

    def plan(self, problem: PlanningProblem) -> Path | PlanFailure:
        """Return a path from the start to the goal, or what stood in the way.

        The path begins at `problem.q_start`; `Path.through` makes one of joint waypoints.
        """
        ...
