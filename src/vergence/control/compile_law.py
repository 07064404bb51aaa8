"""From a servo to the numbers of a law that one kernel can compute."""

from typing import NamedTuple

import numpy as np

from vergence.arrays import FloatArray
from vergence.control._tracking_tick import TrackingTickLaw
from vergence.control.aligned import lifted
from vergence.control.depth import CarriedDepth, Depth, DepthFromFeatures, HeldDepth
from vergence.control.depth.carried import nothing_carried
from vergence.control.depth.from_features import NO_POSE
from vergence.control.image_motion import ExposedFeatures
from vergence.control.objectives import (
    ImageBased,
    Objective,
    OptimalTracking,
    PointPose,
    pack_setup,
)
from vergence.control.past_joints import no_joints
from vergence.control.point_law import (
    CARRIED,
    FROM_FEATURES,
    HELD,
    AsMeasured,
    InverseSolver,
    LawMemory,
    MotionMemory,
    NoMemory,
    PointGoal,
    PointLaw,
    PoseGoal,
    PredictedMotion,
    ProgramSolver,
    TrackingGoal,
    TrackingLaw,
)
from vergence.control.point_weights import row_variance
from vergence.control.servo_camera import ServoCamera
from vergence.control.solvers import BoundSolver
from vergence.control.solvers._program import ProgramState
from vergence.control.solvers.pseudo_inverse import BoundPseudoInverse
from vergence.control.solvers.quadratic_program import BoundProgram
from vergence.control.target_flow import no_flow
from vergence.estimation.feature_faces import FeatureFaces
from vergence.estimation.pose_minima import spread_rotations
from vergence.features import Points
from vergence.robot import Arm
from vergence.signals import Reference

_DEPTHS: dict[type[Depth], int] = {
    HeldDepth: HELD,
    CarriedDepth: CARRIED,
    DepthFromFeatures: FROM_FEATURES,
}
_NO_FACES = FeatureFaces(np.empty((0, 6)), np.empty((0, 0), dtype=np.bool_))


class CompiledLaw(NamedTuple):
    """A law as the kernel `law_tick` computes it."""

    law: PointLaw | TrackingLaw
    memory: LawMemory  # at the start


def compile_law(
    arm: Arm,
    camera: ServoCamera,
    objective: Objective,
    solver: BoundSolver,
    tracking: TrackingTickLaw | None,
    reference: Reference,
    covariance_px: FloatArray,
) -> CompiledLaw | None:
    """Return a servo for a constant reference as numbers; None if the kernel does not know a part.

    Args:
        arm: up to its tip, the camera.
        camera: without distortion.
        objective: the only one, of weight 1.
        solver: for the same arm.
        tracking: the servo, if it is optimal tracking by the inverse of the Jacobian.
        reference: s_star (M, 2), and the depth there if known.
        covariance_px: of every point, (2, 2); a multiple of the unit matrix.
    """
    desired_px = reference.points_px
    assert desired_px is not None
    intrinsics, count, n = camera.mounting.camera, len(desired_px), arm.joint_count
    covariances_px = np.repeat(covariance_px[None], count, axis=0)
    motion = _motion(camera, covariances_px / np.outer(*2 * [intrinsics.focal_px]))
    if motion is None or not camera.mounting.at_tip or intrinsics.distorted:
        return None
    desired, program = intrinsics.normalize(desired_px), ProgramState(0.0, 0.0)
    variance = row_variance(None, intrinsics.normalize_covariance(covariances_px, desired))
    law: PointLaw | TrackingLaw
    if tracking is not None:
        setup = pack_setup(tracking.setup(count))
        as_it_is = camera.motion.as_it_is
        law = TrackingLaw(
            arm.chain,
            AsMeasured(motion.believed_m) if as_it_is else motion,
            setup,
            desired,
            tracking.singular_below,
        )
    else:
        depth_m = reference.desired_depth_m
        goal = _goal(objective, camera, desired, depth_m, variance)
        there = None if depth_m is None else lifted(desired, depth_m)
        solved_by = _solver(solver, arm, camera, there)
        if goal is None or solved_by is None:
            return None
        if isinstance(goal, TrackingGoal) and isinstance(solved_by, InverseSolver):
            return None
        law = PointLaw(arm.chain, motion, goal, solved_by)
        if isinstance(solver, BoundProgram):
            if solver.state is None:
                return None
            program = solver.state
    nowhere = np.full((count, 2), np.nan)
    if isinstance(law.motion, AsMeasured):
        return CompiledLaw(law, LawMemory(NoMemory(), program))
    remembered = MotionMemory(
        no_joints(n),
        ExposedFeatures(-np.inf, np.eye(4), nowhere, np.full(count, np.nan), np.nan),
        no_flow(count),
        nothing_carried(count),
        NO_POSE,
    )
    return CompiledLaw(law, LawMemory(remembered, program))


def _motion(camera: ServoCamera, covariance: FloatArray) -> PredictedMotion | None:
    settings, count = camera.motion, len(covariance)
    believed_m, features = np.array(camera.believed_depth(count)), camera.features
    depth = _DEPTHS.get(type(settings.depth))
    if depth is None:
        return None
    return PredictedMotion(
        believed_m,
        depth,
        np.zeros((count, 3)) if features is None else np.array(features),
        spread_rotations(),
        covariance,
        settings.flow_smoothing_s if settings.feeds_forward else np.inf,
        settings.prediction,
    )


def _goal(
    objective: Objective,
    camera: ServoCamera,
    desired: FloatArray,
    depth_m: FloatArray | None,
    variance: float,
) -> PointGoal | PoseGoal | TrackingGoal | None:
    at_goal = np.full(len(desired), np.nan) if depth_m is None else np.array(depth_m)
    if isinstance(objective, ImageBased) and objective.feature is Points:
        return PointGoal(objective.numbers, desired, at_goal, variance)
    if isinstance(objective, PointPose):
        return PoseGoal(objective.numbers, desired, at_goal)
    if isinstance(objective, OptimalTracking) and objective.S == 0.0:
        gains = objective.gains(len(desired), camera.period_s)
        return TrackingGoal(gains, desired, camera.mounting.camera.focal_px)
    return None


def _solver(
    solver: BoundSolver, arm: Arm, camera: ServoCamera, goal: FloatArray | None
) -> InverseSolver | ProgramSolver | None:
    if isinstance(solver, BoundPseudoInverse):
        return InverseSolver(arm.rate_max, solver.singular_below)
    if not isinstance(solver, BoundProgram) or solver.has_own_limits:
        return None
    faces, features = camera.faces, camera.features
    if faces is None or features is None:
        faces, features = _NO_FACES, np.empty((0, 3))
    return ProgramSolver(
        solver.settings,
        np.array(solver.solids),
        faces is not _NO_FACES,
        np.array(features),
        np.empty((0, 3)) if goal is None else goal,
        np.array(faces.planes),
        np.array(faces.holds),
    )
