"""Ways to go where a photograph was taken, tried on the same photographs and starts."""

from enum import Enum

from vergence.camera.photograph import read_photograph
from vergence.cell import Cell
from vergence.cell.schema import ReachTable
from vergence.planning.approach import GoalImage
from vergence.planning.approach.points import choose_points
from vergence.signals import Outcome, OutcomeKind
from vergence.simulation import SimulatedDriver
from vergence.vision.matching import compare_images
from vergence.vision.two_view import TwoViewFailure

POINTS = 16  # followed, as many as by `Approach`
ENOUGH_S = 12.0  # without a plan; a run that has not arrived by then is at rest or lost


class Method(Enum):
    """Which way."""

    OPTIMISED = "vergence"  # along the path of `OptimisedPlanner`
    POTENTIAL_FIELD = "the paper's planner"  # along that of `PotentialFieldPlanner`
    WITHOUT_PLAN = "without a plan"  # matched points straight to their places


def without_plan(cell: Cell, driver: SimulatedDriver) -> Cell | Outcome:
    """Return a cell whose task brings matched points straight to where the photograph has them.

    They are matched as for a plan, by the same thresholds, and as well spread.

    Args:
        cell: whose task is to go where a photograph was taken.
        driver: of it, at the start.
    """
    task = cell.task
    assert isinstance(task, ReachTable)
    assert task.goal is not None
    camera, image = driver.cameras[task.camera], driver.first_frame(task.camera).image
    assert image is not None
    taken = read_photograph(cell.path.parent / task.goal, camera)
    goal = GoalImage.of(taken.image, camera, task.matcher, taken.shown)
    found = compare_images(image, goal.image, camera, goal.matcher, goal.described)
    if isinstance(found, TwoViewFailure):
        return Outcome(OutcomeKind.INFEASIBLE, str(found), 0.0)
    now, desired = found.matches[:2]
    chosen = choose_points(now, desired, camera, POINTS)
    served = {
        "kind": "track",
        "arm": task.arm,
        "camera": task.camera,
        "points_px": now[chosen].tolist(),
        "desired": desired[chosen].tolist(),
        "until": "reached",
    }
    return cell.replace(task=served, duration_s=ENOUGH_S)
