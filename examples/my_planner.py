"""A planner of your own: planner = "my_planner:Straight" under [task] in a cell beside this file.

vergence plan CELL --planner my_planner:Straight draws its path.
"""

import numpy as np

import vergence as vg
from vergence.planning import Obstacle, Path, PlanFailure, PlanningProblem
from vergence.robot import goal_configurations


@vg.part("planner")
class Straight:
    """Goes straight in joint space to the nearest posture that brings the camera to its goal."""

    waypoints: int = vg.knob(101, least=2, upto=10000)  # of the path

    def plan(self, problem: PlanningProblem) -> Path | PlanFailure:
        """Return the path, or what stands in the way."""
        goals = goal_configurations(problem.arm, problem.T_world_goal, problem.q_start, 1)
        if not len(goals):
            return PlanFailure(Obstacle.REACH, "the arm cannot bring its camera to the goal")
        path = Path.through(
            problem, np.linspace(problem.q_start, goals[0], self.waypoints), "straight"
        )
        if not path.in_view().all():
            return PlanFailure(Obstacle.VISIBILITY, "the straight path leaves the image")
        return path


if __name__ == "__main__":
    print(vg.plan("gantry", images=False, task={"planner": "my_planner:Straight"}))
