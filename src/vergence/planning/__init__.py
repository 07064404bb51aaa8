"""Planning: the desired features or target pose over time."""

from vergence.planning.failure import Obstacle, PlanFailure
from vergence.planning.fixed_reference import FixedReference
from vergence.planning.optimised import OptimisedPlanner
from vergence.planning.path import Path
from vergence.planning.path_planner import PathPlanner
from vergence.planning.potential_field import PotentialFieldPlanner
from vergence.planning.problem import PlanningProblem
from vergence.planning.separation import proves_no_path
from vergence.planning.timing import TimeLaw
from vergence.planning.trajectory import Trajectory

__all__ = [
    "FixedReference",
    "Obstacle",
    "OptimisedPlanner",
    "Path",
    "PathPlanner",
    "PlanFailure",
    "PlanningProblem",
    "PotentialFieldPlanner",
    "TimeLaw",
    "Trajectory",
    "proves_no_path",
]
