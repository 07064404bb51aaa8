"""From a servo to the numbers of a law that one kernel can compute."""

from collections.abc import Sequence
from typing import Any, NamedTuple

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
    Posture,
    pack_setup,
)
from vergence.control.past_joints import no_joints
from vergence.control.point_law import (
    CARRIED,
    FROM_FEATURES,
    HELD,
    IMAGE,
    POSE,
    POSTURE,
    TRACKING,
    AsMeasured,
    InverseSolver,
    LawMemory,
    MotionMemory,
    NoMemory,
    PointGoal,
    PointLaw,
    PredictedMotion,
    ProgramSolver,
    TermNumbers,
    TrackingLaw,
)
from vergence.control.point_weights import row_variance
from vergence.control.servo_camera import ServoCamera
from vergence.control.solvers import BoundSolver
from vergence.control.solvers._program import ProgramState
from vergence.control.solvers.pseudo_inverse import (
    BoundDampedPseudoInverse,
    BoundPseudoInverse,
)
from vergence.control.solvers.quadratic_program import BoundProgram
from vergence.control.target_flow import no_flow
from vergence.control.term import Term
from vergence.estimation.feature_faces import FeatureFaces
from vergence.estimation.pose_minima import spread_rotations
from vergence.features.compiled_features import COMPILED_FEATURES
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
    terms: Sequence[Term],
    solver: BoundSolver,
    tracking: TrackingTickLaw | None,
    reference: Reference,
    covariance_px: FloatArray,
) -> CompiledLaw | None:
    """Return a servo for a constant reference as numbers; None if the kernel does not know a part.

    Args:
        arm: up to its tip, the camera.
        camera: without distortion.
        terms: its objectives, all about this camera.
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
            not as_it_is,
        )
    else:
        depth_m, focal_px = reference.desired_depth_m, intrinsics.focal_px
        numbers = _numbers(terms, arm, count, camera.period_s)
        there = None if depth_m is None else lifted(desired, depth_m)
        solved_by = _solver(solver, arm, camera, there)
        if numbers is None or solved_by is None:
            return None
        at_goal = np.full(count, np.nan) if depth_m is None else np.array(depth_m)
        goal = PointGoal(numbers, desired, at_goal, variance, focal_px, camera.period_s)
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


def _numbers(terms: Sequence[Term], arm: Arm, count: int, period_s: float) -> TermNumbers | None:
    """Return objectives as numbers; None if kernels do not know one of them."""
    nothing: dict[str, Any] = dict.fromkeys(("feature", "interaction"), 0)
    nothing |= dict.fromkeys(("damping", "Q", "strength"), 0.0)
    nothing |= dict.fromkeys(("controlled", "R"), np.zeros(6))
    nothing |= {"gain": np.zeros(3), "position": np.zeros(arm.joint_count)}
    rows = [_row(term.objective, arm, count, period_s) for term in terms]
    if None in rows:
        return None
    whole = [nothing | (row or {}) for row in rows]
    columns = {name: np.array([row[name] for row in whole]) for name in TermNumbers._fields[1:]}
    return TermNumbers(np.array([term.weight for term in terms]), **columns)


def _row(objective: Objective, arm: Arm, count: int, period_s: float) -> dict[str, Any] | None:
    if isinstance(objective, ImageBased) and objective.feature in COMPILED_FEATURES:
        feature = COMPILED_FEATURES[objective.feature]
        return {"kind": IMAGE, **objective.numbers(feature)._asdict()}
    if isinstance(objective, PointPose):
        return {"kind": POSE, **objective.numbers._asdict()}
    if isinstance(objective, OptimalTracking) and objective.S == 0.0:
        gains = objective.gains(count, period_s)
        return {"kind": TRACKING, "controlled": gains.controlled, "Q": gains.Q, "R": gains.R}
    if isinstance(objective, Posture):
        return {"kind": POSTURE, **objective.numbers(arm)._asdict()}
    return None


def _solver(
    solver: BoundSolver, arm: Arm, camera: ServoCamera, goal: FloatArray | None
) -> InverseSolver | ProgramSolver | None:
    if isinstance(solver, BoundPseudoInverse | BoundDampedPseudoInverse):
        damped = isinstance(solver, BoundDampedPseudoInverse)
        return InverseSolver(arm.rate_max, solver.singular_below, damped)
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
