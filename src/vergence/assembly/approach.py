"""Planning when far: a path to desired points of known features, where goal and scale are known."""

from dataclasses import replace

import numpy as np

from vergence.arrays import FloatArray
from vergence.assembly.law_context import LawContext
from vergence.assembly.limits_on_plan import PLAN_MARGIN_JOINT, PLAN_MARGIN_PX
from vergence.assembly.target_faces import TargetFaces
from vergence.cell.schema import TrackTable
from vergence.control.depth.from_features import fixes_pose
from vergence.estimation import CornerView, NoPose, PoseFit, fit_pose
from vergence.geometry import transform_points
from vergence.planning import (
    FixedReference,
    Obstacle,
    OptimisedPlanner,
    Path,
    PlanFailure,
    PlanningProblem,
    Trajectory,
)
from vergence.planning.approach import Worker
from vergence.planning.replanner import Replanner
from vergence.runtime.stages import Planner
from vergence.signals import Reference

_CAMERA_SPEED = 0.25  # m/s on the way


def desired_depth(
    context: LawContext, task: TrackTable, desired_px: FloatArray
) -> FloatArray | None:
    """Return the depth of the features at the goal, (M,), m; None where it does not follow."""
    goal = _pose_in_camera(context, task, desired_px)
    if goal is None:
        return None
    features = context.known_features(task.camera)
    assert features is not None
    depth: FloatArray = transform_points(goal.T_world_target.copy(), features)[:, 2].copy()
    return depth


def approach_to(
    context: LawContext,
    task: TrackTable,
    points_px: FloatArray,
    reference: Reference,
    worker: Worker,
) -> Planner | PlanFailure:
    """Return what leads to the desired points, and plans again where the arm stalls.

    Without a plan, where goal or scale are not known or no path was found, the law goes straight.

    Args:
        context: of the task.
        task: with the desired points.
        points_px: the features in the first image, (M, 2).
        reference: with the desired points.
        worker: plans while the loop runs.

    Returns:
        The planner; or why the goal cannot be reached at all.
    """
    desired_px = reference.points_px
    assert desired_px is not None
    if task.approach != "auto" or not _can_plan(context, task):
        return FixedReference(reference)
    desired = desired_px.copy()

    def plan(points_px: FloatArray, q: FloatArray) -> Trajectory | str:
        found = plan_approach(context, task, points_px, desired, q)
        return found if isinstance(found, Trajectory) else str(found)

    found = plan_approach(context, task, points_px, desired, context.joints[task.arm])
    if isinstance(found, Trajectory):
        return Replanner(found, plan, worker)
    if found.proved or found.obstacle is Obstacle.REACH:
        return found
    return Replanner(FixedReference(reference), plan, worker)


def plan_approach(
    context: LawContext,
    task: TrackTable,
    points_px: FloatArray,
    desired_px: FloatArray,
    q: FloatArray,
) -> Trajectory | PlanFailure:
    """Plan from where known features are seen to where they are desired.

    Args:
        context: of the task.
        task: whose camera sees them.
        points_px: as they are seen, (M, 2).
        desired_px: as they are desired, (M, 2).
        q: joint positions there, (n,).

    Returns:
        The path in time, or what stood in the way.
    """
    features = context.known_features(task.camera)
    assert features is not None
    now = _pose_in_camera(context, task, points_px)
    goal = _pose_in_camera(context, task, desired_px)
    if now is None or goal is None:
        where = "at the start" if now is None else "as desired"
        return PlanFailure(
            Obstacle.START, f"the features {where} do not determine the target's pose"
        )
    arm = context.arm_to_camera(task.camera)
    problem = PlanningProblem.from_poses(
        now,
        goal,
        features,
        arm,
        context.cameras[task.camera],
        q,
        margin_px=PLAN_MARGIN_PX,
        margin_joint=PLAN_MARGIN_JOINT,
        bodies=context.bodies,
    )
    faces = TargetFaces.of(context, task.camera)
    if faces is not None:
        problem = replace(problem, surface=faces.at(problem.points_world))
    found = OptimisedPlanner().plan(problem)
    return Trajectory.of(found, _CAMERA_SPEED, desired_px) if isinstance(found, Path) else found


def _can_plan(context: LawContext, task: TrackTable) -> bool:
    """Return whether a goal and a scale exist: stated points of known features at rest."""
    if isinstance(task.desired, str) or context.known_features(task.camera) is None:
        return False
    return not context.is_fixed and task.tool is None and context.declared_stationary


def _pose_in_camera(context: LawContext, task: TrackTable, points_px: FloatArray) -> PoseFit | None:
    """Return the pose of the target in the camera at which its features look so; None without one.

    Of several that fit equally, the likeliest.
    """
    features = context.known_features(task.camera)
    if features is None or not fixes_pose(features) or features.shape[0] != len(points_px):
        return None
    if not np.isfinite(points_px).all():
        return None
    view = CornerView(context.cameras[task.camera], np.eye(4), np.asarray(points_px))
    fit = fit_pose(features, [view])
    if isinstance(fit, NoPose):
        if not fit.alternatives:
            return None
        fit = fit.alternatives[0]
    return fit
