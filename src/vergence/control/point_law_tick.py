"""The tick of a servo on image points as one kernel.

It is `Servo.command` for one camera at the arm's tip and a constant reference, by the same kernels
in the same order. Solvers and motions are told apart by their types, so that only what a law uses
is compiled; objectives by numbers, so that it is compiled once for all of their sums.
"""

from collections.abc import Callable, Mapping
from inspect import signature
from types import FunctionType
from typing import Any

import numpy as np
from numba import njit
from numba.extending import overload

from vergence.arrays import BoolArray, FloatArray
from vergence.control.aligned import fixes_orientation, lifted
from vergence.control.depth.carried import carried_depths
from vergence.control.depth.from_features import fitted_depths
from vergence.control.image_motion import (
    ExposedFeatures,
    FeatureState,
    predicted_features,
    unexplained_flow,
)
from vergence.control.limits import pack_features
from vergence.control.objectives import optimal_tracking_tick
from vergence.control.objectives._tracking import TrackingGains
from vergence.control.objectives.gain import GainNumbers
from vergence.control.objectives.image_based import PointDecay, point_quadratic
from vergence.control.objectives.optimal_tracking import tracking_quadratic
from vergence.control.objectives.point_pose import PoseDecay, pose_quadratic
from vergence.control.objectives.posture import PostureDecay, posture_quadratic
from vergence.control.past_joints import past_position, remember
from vergence.control.point_law import (
    CARRIED,
    FINE,
    FROM_FEATURES,
    HELD,
    IMAGE,
    NONSENSE,
    POSE,
    POSTURE,
    SINGULAR,
    UNDETERMINED,
    AsMeasured,
    InverseSolver,
    LawMemory,
    LawTick,
    Moment,
    MotionMemory,
    NoMemory,
    PointGoal,
    PointLaw,
    PredictedMotion,
    ProgramSolver,
    SeenPoints,
    TrackingLaw,
    Wish,
)
from vergence.control.shown_faces import shown_faces
from vergence.control.solvers._program import FurtherRows, ProgramState, program_tick
from vergence.control.solvers.pseudo_inverse import damped_rates, pseudo_inverse_rates
from vergence.control.solvers.solver import Problem
from vergence.control.sum_of_terms import Total
from vergence.control.target_flow import flow_at, measured_flow
from vergence.geometry import se3_inverse
from vergence.robot.chain import forward_kinematics


def by_type(functions: Mapping[type, Callable[..., Any]]) -> Callable[[Callable[..., Any]], Any]:
    """Return a decorator of a function that is, in kernels, the one for its first argument.

    The functions become part of the kernel that calls them: compiled by themselves as well, each
    would cost its time again.

    Args:
        functions: by the type of their first argument; their parameters have the same names.
    """
    bare = {part: FunctionType(f.__code__, f.__globals__) for part, f in functions.items()}

    def declare(function: Callable[..., Any]) -> Callable[..., Any]:
        def choose(part: Any, *_others: Any) -> Callable[..., Any]:
            return bare[part.instance_class]

        choose.__signature__ = signature(next(iter(bare.values())))  # type: ignore[attr-defined]
        overload(function, jit_options={"error_model": "numpy"})(choose)
        return function

    return declare


def measured_now(
    motion: AsMeasured, memory: NoMemory, now: Moment
) -> tuple[NoMemory, FeatureState]:
    """Return features as they were measured."""
    points = now.image.points
    return memory, FeatureState(points, np.zeros_like(points), motion.believed_m, np.nan)


def predicted_now(
    motion: PredictedMotion, memory: MotionMemory, now: Moment
) -> tuple[MotionMemory, FeatureState]:
    """Process an image and return the features now, as `ImageMotion.update` does.

    Args:
        motion: the assumptions.
        memory: of the images before.
        now: the input of the tick.
    """
    image, chain = now.image, now.chain
    remember(memory.joints, now.time, now.q)
    q_exposed = past_position(memory.joints, image.time)
    T_camera_scene = se3_inverse(forward_kinematics(chain, q_exposed))
    pose, carried, depth_m, share = memory.pose, memory.carried, motion.believed_m, np.nan
    if motion.depth == FROM_FEATURES:
        pose, depth_m, share = fitted_depths(
            pose, T_camera_scene, image.points, image.found, motion.covariance, depth_m,
            motion.features, motion.rotations,
        )  # fmt: skip
    elif motion.depth == CARRIED:
        unknown = np.full(len(depth_m), np.nan)
        depth_m, carried = carried_depths(
            carried, T_camera_scene, image.points, image.found, depth_m, unknown
        )
    flow = memory.flow
    if memory.exposed.time > -np.inf:
        elapsed_s = image.time - memory.exposed.time
        seen = unexplained_flow(memory.exposed, T_camera_scene, image.points, elapsed_s)
        flow = measured_flow(flow, seen, image.found, elapsed_s, motion.smoothing_s)
    exposed = ExposedFeatures(image.time, T_camera_scene, image.points, depth_m, share)
    after = MotionMemory(memory.joints, exposed, flow, carried, pose)
    if not motion.prediction:
        return after, FeatureState(image.points, flow_at(flow, 0.0), depth_m, share)
    here, late_s = se3_inverse(forward_kinematics(chain, now.q)), now.time - image.time
    moved = predicted_features(exposed, flow, here, motion.believed_m, late_s)
    if motion.depth == HELD:
        moved = FeatureState(moved.points, moved.flow, motion.believed_m, moved.depth_share)
    return after, moved


@by_type({AsMeasured: measured_now, PredictedMotion: predicted_now})
def features_now(motion: Any, memory: Any, now: Moment) -> tuple[Any, FeatureState]:
    """Return the features now, and the memory after this image."""
    raise NotImplementedError


@njit(cache=True, error_model="numpy")
def _depth_at_goal(depth_m: FloatArray, now: FeatureState, found: BoolArray) -> FloatArray:
    """Return the depth of the features found (M,) at the goal: the present one if unknown."""
    return now.depth if np.isnan(depth_m).any() else depth_m[found]


@njit(cache=True, error_model="numpy")
def _total(
    goal: PointGoal, now: FeatureState, image: SeenPoints, q: FloatArray
) -> tuple[int, Total]:
    """Return the sum of the objectives as `total_of` does, or why there is none."""
    terms, found = goal.terms, image.found
    desired, there = goal.desired[found], _depth_at_goal(goal.depth_m, now, found)
    n = len(q) if (terms.kind == POSTURE).any() else 0
    H, g, variance = np.zeros((6, 6)), np.zeros(6), 0.0
    H_joints, g_joints = np.zeros((n, n)), np.zeros(n)
    for i in range(len(terms.kind)):
        gain, kind, weight = _gain(terms.gain[i]), terms.kind[i], terms.weight[i]
        if kind == POSTURE:
            pull = posture_quadratic(PostureDecay(gain, terms.position[i], terms.strength[i]), q)
            H_joints += weight * pull.H
            g_joints += weight * pull.g
            continue
        if kind == IMAGE:
            decay = PointDecay(terms.feature[i], gain, terms.interaction[i], terms.damping[i])
            quadratic = point_quadratic(
                decay, now.points, now.depth, desired, there, now.flow, np.empty((0, 2, 2)),
                goal.variance,
            )  # fmt: skip
        elif kind == POSE:
            seen, aim = lifted(now.points, now.depth), lifted(desired, there)
            if not (fixes_orientation(seen) and fixes_orientation(aim)):
                return UNDETERMINED, Total(H, g, H_joints, g_joints, variance)
            quadratic = pose_quadratic(PoseDecay(gain, terms.controlled[i]), seen, aim)
        else:
            axes, T = terms.controlled[i], goal.period_s
            quadratic = tracking_quadratic(
                _columns(now, desired, True), goal.focal_px,
                TrackingGains(terms.Q[i], terms.R[i], 0.0, axes, axes, 0.0, T), 1.0, np.zeros(6),
            )  # fmt: skip
        H += weight * quadratic.H
        g += weight * quadratic.g
        variance += weight * quadratic.variance
    finite = np.isfinite(H).all() and np.isfinite(g).all() and np.isfinite(g_joints).all()
    return FINE if finite else NONSENSE, Total(H, g, H_joints, g_joints, variance)


@njit(cache=True, error_model="numpy")
def _gain(row: FloatArray) -> GainNumbers:
    return GainNumbers(row[0], row[1], row[2])


@njit(cache=True, error_model="numpy")
def _columns(now: FeatureState, desired: FloatArray, with_flow: bool) -> FloatArray:
    """Return features as the kernels of optimal tracking take them, (M, 5), or (M, 7) with flow."""
    columns = np.empty((len(desired), 7 if with_flow else 5))
    columns[:, :2], columns[:, 2:4], columns[:, 4] = now.points, desired, now.depth
    if with_flow:
        columns[:, 5:] = now.flow
    return columns


def _by_inverse(
    solver: InverseSolver, state: ProgramState, wish: Wish
) -> tuple[ProgramState, LawTick]:
    now, total, secondary = wish.now, wish.total, np.zeros(len(wish.now.q))
    if len(total.g_joints):
        secondary[:] = np.linalg.solve(total.H_joints, total.g_joints)
    if solver.damped:
        rates, _ = damped_rates(
            now.chain, now.q, solver.rate_max, total.H, total.g, secondary, solver.singular_below
        )
        return state, LawTick(rates, FINE, np.nan)
    tick = pseudo_inverse_rates(now.chain, now.q, solver.rate_max, total.H, total.g, secondary)
    end = SINGULAR if tick.sigma < solver.singular_below else FINE
    return state, LawTick(tick.rates, end, tick.sigma)


def _by_program(
    solver: ProgramSolver, state: ProgramState, wish: Wish
) -> tuple[ProgramState, LawTick]:
    now, features, found, total = wish.now, wish.features, wish.now.image.found, wish.total
    n, faces, none = len(now.q), np.empty((0, 6)), np.empty(0)
    if solver.surface_known:
        here, goal = lifted(features.points, features.depth), solver.goal
        if len(goal):
            goal = goal[found]
        faces = shown_faces(solver.features[found], here, goal, solver.planes, solver.holds[found])
    problem = Problem(
        now.q,
        now.velocity,
        total.H,
        total.g,
        pack_features(features.points, features.flow, features.depth, None),
        np.zeros(n),
        total.H_joints,
        total.g_joints,
        np.empty((0, 0)),
        0.0,
        features.depth_share,
        total.variance,
        faces,
        solver.surface_known,
    )
    further = FurtherRows(np.empty((0, n)), none, np.empty(0, dtype=np.int64))
    answer, state = program_tick(now.chain, solver.settings, state, problem, solver.solids, further)
    return state, LawTick(answer.rates, FINE, np.nan)


@by_type({InverseSolver: _by_inverse, ProgramSolver: _by_program})
def solved_by(solver: Any, state: ProgramState, wish: Wish) -> tuple[ProgramState, LawTick]:
    """Return the joint rates that serve the objectives best, and the solver's state after it."""
    raise NotImplementedError


def _point_law_tick(law: PointLaw, memory: LawMemory, now: Moment) -> tuple[LawMemory, LawTick]:
    motion, features = features_now(law.motion, memory.motion, now)
    features = _found(features, now.image.found)
    end, total = _total(law.goal, features, now.image, now.q)
    if end != FINE or not total.H.any():
        after = LawMemory(motion, memory.program)
        return after, LawTick(np.zeros(len(now.q)), end, float(len(features.points)))
    program, tick = solved_by(law.solver, memory.program, Wish(now, features, total))
    return LawMemory(motion, program), tick


def _tracking_law_tick(
    law: TrackingLaw, memory: LawMemory, now: Moment
) -> tuple[LawMemory, LawTick]:
    motion, features = features_now(law.motion, memory.motion, now)
    features, desired = _found(features, now.image.found), law.desired[now.image.found]
    columns = _columns(features, desired, law.feeds_forward)
    answer, n = np.empty(len(now.q) + 10), len(now.q)
    optimal_tracking_tick(law.setup.weights, law.setup.joints, now.q, columns, answer)
    sigma = answer[n + 9]
    end = SINGULAR if sigma < law.singular_below else FINE
    return LawMemory(motion, memory.program), LawTick(answer[:n], end, sigma)


@by_type({PointLaw: _point_law_tick, TrackingLaw: _tracking_law_tick})
def law_tick(law: Any, memory: LawMemory, now: Moment) -> tuple[LawMemory, LawTick]:
    """Return the joint rates for a moment, and the memory after it.

    Args:
        law: its numbers.
        memory: from the tick before.
        now: the input of the tick.
    """
    raise NotImplementedError


@njit(cache=True, error_model="numpy")
def _found(features: FeatureState, found: BoolArray) -> FeatureState:
    """Return the features that were found."""
    if found.all():
        return features
    return FeatureState(
        features.points[found], features.flow[found], features.depth[found], features.depth_share
    )
