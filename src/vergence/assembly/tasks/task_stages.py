"""From the parts of a task to the stages that the loop runs it by."""

from vergence.arrays import FloatArray
from vergence.assembly.camera_poses import camera_poses
from vergence.assembly.law_context import LawContext
from vergence.assembly.parts import Parts
from vergence.cell import Cell
from vergence.cell.schema import AdvanceTable, ReachTable, SwitchTable, Task, TrackTable
from vergence.errors import InputError
from vergence.loading import asking
from vergence.parts import kind_of
from vergence.planning.from_now import FromNow
from vergence.planning.replanner import Replanner
from vergence.planning.trajectory import Trajectory
from vergence.runtime import Timeouts
from vergence.runtime.arrival import Goal
from vergence.runtime.stages import Stages
from vergence.runtime.task_ends import EndSetting, Until, looks_for_target


def stages_of(cell: Cell, parts: Parts, later: bool = False) -> Stages:
    """Return what a task is done by.

    Args:
        cell: with the task alone.
        parts: of the task.
        later: whether it begins while the loop runs.

    Raises:
        InputError: if its `until` does not fit the arm.
    """
    task, planner = cell.task, parts.planner
    if later and isinstance(planner, Trajectory):
        planner = FromNow(planner)
    elif later and isinstance(planner, Replanner):
        planner.begin_later()
    return Stages(
        parts.perception,
        planner,
        parts.law,
        timeouts_of(task),
        _goal(task),
        until_of(parts.context),
        parts.duration_s or float("inf"),
    )


def until_of(context: LawContext) -> Until | None:
    """Return what ends a task by its `until`; None without one.

    Raises:
        InputError: if it does not fit the arm.
    """
    cell, task = context.cell, context.cell.task
    if task.until is None:
        return None
    if isinstance(task, SwitchTable) and looks_for_target(task.until):
        given = f"{kind_of(task.until)}, in a task that uses no images"
        raise InputError(
            str(cell.path), "task.until", given, "wait_s, or an end that needs no image"
        )
    poses = camera_poses(context)

    def camera_pose(q: FloatArray) -> FloatArray:
        return poses(task.camera, {task.arm: q})

    source = str(cell.path)
    with asking(task.until, source, "task.until"):
        try:
            until: Until = task.until.bind(EndSetting(context.arm, camera_pose))
        except InputError as error:
            key = ".".join(filter(None, ("task.until", error.key)))
            raise InputError(source, key, error.given, error.allowed) from None
    return until


def timeouts_of(task: Task) -> Timeouts:
    """Return how long the loop waits in a task; one without a target waits for none."""
    if isinstance(task, AdvanceTable | SwitchTable):
        return Timeouts(task.image_timeout_s)
    return Timeouts(task.image_timeout_s, task.target_timeout_s)


def _goal(task: Task) -> Goal | None:
    if not isinstance(task, ReachTable | TrackTable):
        return None
    return Goal(task.tolerance_px, ends=isinstance(task, ReachTable))
