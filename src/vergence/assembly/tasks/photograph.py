"""The task `reach` by a photograph: to where it was taken, by images alone."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from vergence.assembly.build_law import build_law
from vergence.assembly.law_context import LawContext
from vergence.assembly.own_matcher import OwnMatcher
from vergence.assembly.own_parts import planned_path
from vergence.assembly.parts import Parts
from vergence.assembly.started_driver import StartedDriver
from vergence.camera.photograph import Photograph, read_photograph
from vergence.cell import Cell
from vergence.cell.joint_positions import goal_positions
from vergence.cell.schema import ReachTable
from vergence.cell.tasks import require_one_task
from vergence.control import ServoSettings
from vergence.errors import NOTHING, InputError
from vergence.planning.approach import (
    Approach,
    ApproachSettings,
    GoalImage,
    KnownLength,
)
from vergence.planning.failure import PlanFailure
from vergence.planning.path import Path as PlannedPath
from vergence.planning.trajectory import Trajectory
from vergence.signals import Outcome, OutcomeKind
from vergence.simulation import SimulatedDriver
from vergence.vision.two_view import TwoViewFailure


def is_by_photograph(cell: Cell) -> bool:
    """Whether a cell's task is to reach what a photograph shows, without known features."""
    task = cell.task
    if not isinstance(task, ReachTable) or cell.target.tag is not None:
        return False
    return cell.target.features is None or task.goal_deg is None


def photograph_parts(
    context: LawContext, task: ReachTable, driver: StartedDriver, images: bool
) -> Parts | Outcome:
    """Put together what goes to where a photograph was taken; or why it cannot."""
    require_photograph(context, images)
    approach = make_approach(context, task, driver)
    plan = approach.begin(driver.frames[task.camera])
    if isinstance(plan, TwoViewFailure):
        return Outcome(OutcomeKind.INFEASIBLE, str(plan), 0.0)
    if isinstance(plan, PlanFailure):
        return plan.outcome(0.0)
    left = driver.time_left(context.cell.duration_s)
    if plan.duration > left:
        reason = f"the path takes {plan.duration:.1f} s, and duration_s leaves {left:.4g} s"
        return Outcome(OutcomeKind.INFEASIBLE, reason, 0.0)
    seen = approach.recognition
    assert seen is not None
    context = replace(context, cell=without_target_motion(context.cell), points_on_anything=True)
    context = context.with_points({task.camera: seen.points_px})
    return Parts(driver, approach, approach, build_law(context), context)


def without_target_motion(cell: Cell) -> Cell:
    """Return a cell whose law feeds no motion of the target forward.

    The points followed change on the way, so no motion of theirs can be told from image to image.
    """
    if not isinstance(cell.law, ServoSettings):
        return cell
    return cell.model_copy(update={"law": replace(cell.law, feed_forward=False)})


def require_photograph(context: LawContext, images: bool) -> None:
    """Refuse a photograph that cannot be read, and a run that would not recognise it.

    Raises:
        InputError: that names it.
    """
    cell = context.cell
    if not images:
        given = "--no-images, but the goal is recognised in images"
        raise InputError(str(cell.path), "task.goal", given, "images")
    assert isinstance(cell.task, ReachTable)
    if cell.task.goal is not None:
        read_photograph(cell.path.parent / cell.task.goal, context.cameras[cell.task.camera])


def make_approach(context: LawContext, task: ReachTable, driver: StartedDriver) -> Approach:
    """Return what goes to where a photograph was taken; it has not looked yet."""
    taken = take_goal(context, task, driver)
    camera = context.cameras[task.camera]
    length = None
    if task.length is not None:
        ends = taken.in_image(np.array(task.length.points_px), camera)
        length = KnownLength(ends, task.length.length_m)
    settings = ApproachSettings(
        length=length,
        tolerance_m=task.tolerance_m,
        tolerance_rad=float(np.deg2rad(task.tolerance_deg)),
        distance_m=taken.distance_m if task.distance_m is None else task.distance_m,
        margin_px=task.margin_px,
        margin_joint=task.margin_joint,
        camera_speed_m_s=task.camera_speed_m_s,
        luminance=task.finish == "luminance",
    )
    matcher = OwnMatcher(task.matcher, str(context.cell.path))
    return Approach(
        GoalImage.of(taken.image, camera, matcher, taken.shown),
        task.camera,
        task.arm,
        context.arm_to_camera(task.camera),
        lambda problem: planned_path(context, task.planner, problem),
        settings,
        driver.worker(),
    )


def take_goal(context: LawContext, task: ReachTable, driver: StartedDriver) -> Photograph:
    """Return the photograph: from its file, or as a simulation takes it by driving there."""
    cell, camera = context.cell, context.cameras[task.camera]
    if task.goal is not None:
        return read_photograph(cell.path.parent / task.goal, camera)
    if task.goal_deg is None or not isinstance(driver.driver, SimulatedDriver):
        needed = (
            "a photograph taken at the goal, see `vergence goal`; or task.goal_deg with "
            "target.features, four or more known points"
        )
        raise InputError(str(cell.path), "task.goal", NOTHING, needed)
    arm = context.model.arms[task.arm]
    goal = goal_positions(cell, arm)
    image = driver.driver.frame_at(task.camera, task.arm, goal).image
    assert image is not None
    return Photograph(image, None, {}, None, camera)


def plan_approach(
    context: LawContext, task: ReachTable, driver: StartedDriver
) -> PlannedPath | PlanFailure | TwoViewFailure:
    """Recognise the photograph from the start and plan the path to where it was taken."""
    plan = make_approach(context, task, driver).begin(driver.frames[task.camera])
    return plan.path if isinstance(plan, Trajectory) else plan


def with_goal(cell: Cell, photograph: Path) -> Cell:
    """Return a cell whose task is to go where a photograph was taken, with the same camera.

    Raises:
        InputError: if it has several tasks.
    """
    require_one_task(cell, "one [task] for --goal; else `goal` in one of the tasks")
    task = cell.task
    kept = task.model_dump() if isinstance(task, ReachTable) else {}
    goal = {
        **kept,
        "kind": "reach",
        "arm": task.arm,
        "camera": task.camera,
        "goal": photograph.resolve(),
        "goal_deg": None,
    }
    if cell.target.tag is not None:  # whose corners are the features
        return cell.replace(task=goal)
    changed = cell.replace(task=goal, target={"features": None})
    return changed if kept else changed.replace(law={"kind": "image_based"})
