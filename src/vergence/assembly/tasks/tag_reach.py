"""The task `reach` for a target with a tag: to where an image of the tag was taken."""

from dataclasses import replace

import numpy as np

from vergence.arrays import FloatArray
from vergence.assembly.approach import plan_approach
from vergence.assembly.build_law import build_law
from vergence.assembly.first_points import first_points
from vergence.assembly.law_context import LawContext
from vergence.assembly.parts import Parts
from vergence.assembly.started_driver import StartedDriver
from vergence.assembly.tag import TagFinder
from vergence.assembly.tasks.photograph import take_goal
from vergence.assembly.tasks.reach import SETTLE_S
from vergence.cell.joint_positions import goal_positions
from vergence.cell.schema import ReachTable, TrackTable
from vergence.errors import InputError
from vergence.parts import kind_of
from vergence.planning import Path, PlanFailure, Trajectory
from vergence.planning.replanner import Replanner
from vergence.signals import Frame, Outcome, OutcomeKind
from vergence.simulation import ExactPoints, SimulatedDriver

# What a reach without a tag needs or offers, and this one has no use for.
_UNUSED = ("distance_m", "length", "margin_px", "margin_joint", "camera_speed_m_s")


def tag_reach_parts(
    context: LawContext, task: ReachTable, driver: StartedDriver, images: bool
) -> Parts | Outcome:
    """Put together what brings the tag's corners to where the goal's image has them.

    The tag tells scale and pose, so the path is planned as that of a `track` with
    `approach = "auto"`.

    Raises:
        InputError: if the goal's image does not show the tag, or a key has no use.
    """
    context, track, desired = _as_track(context, task, driver, images)
    points_px, perception = first_points(context, "target", task.camera, driver, images)
    context = context.with_points({task.camera: points_px})

    def plan(points_px: FloatArray, q: FloatArray) -> Trajectory | str:
        found = plan_approach(context, track, points_px, desired, q)
        return found if isinstance(found, Trajectory) else str(found)

    trajectory = plan_approach(context, track, points_px, desired, context.joints[task.arm])
    if isinstance(trajectory, PlanFailure):
        return trajectory.outcome(0.0)
    duration = trajectory.duration + SETTLE_S
    if duration > (left := driver.time_left(context.cell.duration_s)):
        reason = f"the path takes {duration:.1f} s, and duration_s leaves {left:.4g} s"
        return Outcome(OutcomeKind.INFEASIBLE, reason, 0.0)
    planner = Replanner(trajectory, plan, driver.worker())
    return Parts(driver, perception, planner, build_law(context), context, duration)


def plan_tag_reach(
    context: LawContext, task: ReachTable, driver: StartedDriver, images: bool
) -> Path | PlanFailure:
    """Plan the path from where the tag is seen to where the goal's image has it."""
    context, track, desired = _as_track(context, task, driver, images)
    points_px, _ = first_points(context, "target", task.camera, driver, images)
    found = plan_approach(context, track, points_px, desired, context.joints[task.arm])
    return found.path if isinstance(found, Trajectory) else found


def _as_track(
    context: LawContext, task: ReachTable, driver: StartedDriver, images: bool
) -> tuple[LawContext, TrackTable, FloatArray]:
    """Return context and task of tracking the tag to where the goal's image has it, (4, 2), px."""
    _require_used(context, task)
    desired = goal_corners(context, task, driver, images)
    track = TrackTable(
        name=task.name,
        arm=task.arm,
        camera=task.camera,
        desired=tuple((u, v) for u, v in desired.tolist()),
        approach="auto",
    )
    track = track.model_copy(update={"tracker": task.tracker, "until": task.until})
    cell = context.cell.model_copy(update={"task": track})
    return replace(context, cell=cell), track, desired


def goal_corners(
    context: LawContext, task: ReachTable, driver: StartedDriver, images: bool
) -> FloatArray:
    """Return the corners of the tag in the goal's image, (4, 2), px."""
    if not images:
        assert isinstance(driver.driver, SimulatedDriver)
        q = goal_positions(context.cell, context.model.arms[task.arm])
        frame = driver.driver.frame_at(task.camera, task.arm, q)
        exact = ExactPoints(task.camera, rng=np.random.default_rng([context.cell.seed, 3]))
        observation = exact.observe((frame,))
        assert observation is not None
        return observation.views[-1].points_px
    tag = context.cell.target.tag
    assert tag is not None
    image = take_goal(context, task, driver).image
    frame = Frame(task.camera, 0.0, image, {})
    finder = TagFinder(tag)
    found = finder.tag(frame)
    if isinstance(found, str):
        source = str(context.cell.path)
        raise finder.refusal(frame, source, "task.goal", "in the goal's image", "in it")
    return found.corners_px


def _require_used(context: LawContext, task: ReachTable) -> None:
    """Refuse keys that would have no effect."""
    fields = ReachTable.model_fields
    changed = [key for key in _UNUSED if getattr(task, key) != fields[key].default]
    changed += [
        key for key in ("planner", "matcher") if kind_of(getattr(task, key)) != fields[key].default
    ]
    if changed:
        given = f"{changed[0]}, which has no effect for a target with a tag"
        allowed = "none: the tag determines pose and scale"
        raise InputError(str(context.cell.path), f"task.{changed[0]}", given, allowed)
