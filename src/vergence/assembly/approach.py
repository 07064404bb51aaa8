"""Planning when far: a path to desired points of known features, where goal and scale are known."""

import numpy as np

from vergence.arrays import FloatArray
from vergence.assembly.build_law import PLAN_MARGIN_JOINT, PLAN_MARGIN_PX
from vergence.assembly.law_context import LawContext
from vergence.cell.schema import TrackTable
from vergence.control.depth.from_features import fixes_pose
from vergence.estimation import CornerView, NoPose, fit_pose
from vergence.geometry import se3_inverse, transform_points
from vergence.planning import (
    Obstacle,
    OptimisedPlanner,
    Path,
    PlanFailure,
    PlanningProblem,
    Trajectory,
)

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
    depth: FloatArray = transform_points(goal, features)[:, 2].copy()
    return depth


def plan_approach(
    context: LawContext, task: TrackTable, points_px: FloatArray, desired_px: FloatArray
) -> Trajectory | PlanFailure | None:
    """Plan from what the first image shows to the desired points.

    Returns:
        The path in time; why the goal cannot be reached at all; or None where the law has to go
        without a plan: goal or scale are not known, or no path was found though there may be one.
    """
    features = context.known_features(task.camera)
    if features is None or not _can_plan(context, task):
        return None
    now = _pose_in_camera(context, task, points_px)
    goal = _pose_in_camera(context, task, desired_px)
    if now is None or goal is None:
        return None
    arm, q = context.arm_to_camera(task.camera), context.joints[task.arm]
    T_world_target = arm.forward_kinematics(q) @ now
    problem = PlanningProblem(
        arm,
        context.cameras[task.camera],
        q,
        T_world_target @ se3_inverse(goal),
        transform_points(T_world_target, features),
        PLAN_MARGIN_PX,
        PLAN_MARGIN_JOINT,
    )
    found = OptimisedPlanner().plan(problem)
    if isinstance(found, Path):
        return Trajectory.of(found, _CAMERA_SPEED)
    return found if found.proved or found.obstacle is Obstacle.REACH else None


def _can_plan(context: LawContext, task: TrackTable) -> bool:
    """Tell whether a goal and a scale exist: stated points of known features at rest."""
    stated = not isinstance(task.desired, str)
    return stated and not context.is_fixed and task.tool is None and context.declared_stationary


def _pose_in_camera(
    context: LawContext, task: TrackTable, points_px: FloatArray
) -> FloatArray | None:
    """Return the pose of the target (4, 4) at which its features look so; None if there is none.

    Of several that fit equally, the likeliest.
    """
    features = context.known_features(task.camera)
    if features is None or not fixes_pose(features) or features.shape[0] != len(points_px):
        return None
    view = CornerView(context.cameras[task.camera], np.eye(4), np.asarray(points_px))
    fit = fit_pose(features, [view])
    if isinstance(fit, NoPose):
        if not fit.alternatives:
            return None
        fit = fit.alternatives[0]
    return np.array(fit.T_world_target)
