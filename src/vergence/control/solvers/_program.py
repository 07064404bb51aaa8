"""One tick of the quadratic program with what it remembers, as one kernel."""

from typing import NamedTuple

import numpy as np
from numba import njit

from vergence.arrays import FloatArray, IntArray
from vergence.control.limits import (
    KIND_NAMES,
    SINGULARITY,
    VIEW,
    ConstraintSettings,
    facing_rows,
    flat_face,
)
from vergence.control.solvers._constrained_rates import (
    Avoidance,
    ConstrainedRates,
    Scene,
    Task,
    constrained_rates,
)
from vergence.control.solvers.solver import Problem
from vergence.robot.chain import Chain, jacobian

_DEPTH_SIGMAS, _DEPTH_FLOOR = 2.0, 0.02  # standard deviations of a depth, and an added fraction
_REST = 1e-3  # fraction of the rate limits below which an arm is at rest
_UNSTEADY = 0.5  # fraction of the largest change of rates per period that noise may cause
_KEPT = 0.9  # fraction of the present rates kept against noise: averages over ten images
_STALL_S = 0.5  # at rest, before the limit on manipulability yields
_YIELD_RATE = 2.0  # 1/s, rate at which it does


class ProgramSettings(NamedTuple):
    """The settings of the program for one arm and camera."""

    limits: FloatArray  # rows q_min, q_max, rate_max, acceleration_max, (4, n)
    period: float  # time for which a command acts, s
    constraints: ConstraintSettings
    avoidance: Avoidance
    damping: float  # μ
    adapts_depth: bool  # whether the bounds on the depth follow its deviation, where that is known
    least_sine: float  # of the angle at which a face is seen
    T_tip_camera: FloatArray  # (4, 4) of a camera on the arm


class ProgramState(NamedTuple):
    """What the program remembers from tick to tick."""

    manipulability_min: float  # lower bound on √det(J Jᵀ); 0 for none
    rested_s: float  # time at rest with the limit on manipulability active


class FurtherRows(NamedTuple):
    """Rows C q̇ ≥ d that are not made in kernels."""

    C: FloatArray  # (r, n)
    d: FloatArray  # (r,)
    kind: IntArray  # (r,) of limit


def no_further_rows(joint_count: int) -> FurtherRows:
    """Return no rows."""
    return FurtherRows(np.empty((0, joint_count)), np.empty(0), np.empty(0, dtype=np.int64))


@njit(cache=True, error_model="numpy")
def program_tick(
    chain: Chain,
    program: ProgramSettings,
    state: ProgramState,
    problem: Problem,
    solids: FloatArray,
    further: FurtherRows,
) -> tuple[ConstrainedRates, ProgramState]:
    """Return the joint rates for one tick, and what to remember.

    Args:
        chain: up to the tip.
        program: its settings.
        state: from the tick before.
        problem: of this tick.
        solids: that may occlude features, (K, 16).
        further: of pairs that must not collide, and of the user.
    """
    J = jacobian(chain, problem.q)
    J_camera = problem.A @ J if len(problem.A) else J
    constraints = _constraints(program, state, problem.depth_share)
    faces = problem.faces if problem.surface_known else flat_face(problem.features)
    if constraints.priority[VIEW] == 0:
        faces = faces[:0]
    C, d = facing_rows(faces, J_camera, program.least_sine, constraints.approach_rate)
    preferred, weight = _preferred(program, problem)
    answer = constrained_rates(
        chain,
        program.limits,
        problem.q,
        problem.velocity,
        Task(problem.H, problem.g, problem.H_joints, problem.g_joints, preferred, weight),
        Scene(
            problem.features,
            solids,
            problem.A,
            program.T_tip_camera,
            np.concatenate((C, further.C)),
            np.concatenate((d, further.d)),
            np.concatenate((np.full(len(d), VIEW), further.kind)),
        ),
        program.period,
        constraints,
        program.avoidance,
    )
    return answer, _at_rest(program, state, answer)


@njit(cache=True, error_model="numpy")
def _constraints(
    program: ProgramSettings, state: ProgramState, depth_share: float
) -> ConstraintSettings:
    """Return the margins now, with bounds on the depth from its deviation, if known."""
    known = program.constraints
    low, high = known.depth_low, known.depth_high
    if program.adapts_depth and np.isfinite(depth_share):
        off = _DEPTH_SIGMAS * depth_share + _DEPTH_FLOOR
        low, high = max(1.0 - off, min(low, 0.5)), min(1.0 + off, max(high, 2.0))
    return ConstraintSettings(
        known.approach_rate,
        known.joint_margin,
        known.view_low,
        known.view_high,
        low,
        high,
        state.manipulability_min,
        known.clearance,
        known.priority,
    )


@njit(cache=True, error_model="numpy")
def _preferred(program: ProgramSettings, problem: Problem) -> tuple[FloatArray, FloatArray]:
    """Return preferred joint rates, (n,), and their weights, (n,).

    Near a singularity, little noise causes rates that no joint can follow. Joints therefore keep
    most of their present rates, the more, the more noise alone would change them. Keeping them
    entirely would accumulate the noise; keeping none would make the path to the goal endless.
    """
    free = max(program.damping, problem.null_space_weight)
    steady = problem.variance / (_UNSTEADY * program.period * program.limits[3]) ** 2
    rates = free * problem.null_space_rates + _KEPT * steady * problem.velocity
    return rates / (free + steady), free + steady


@njit(cache=True, error_model="numpy")
def _at_rest(
    program: ProgramSettings, state: ProgramState, answer: ConstrainedRates
) -> ProgramState:
    """Return the state with a lower bound on manipulability while that alone holds the arm at rest.

    Joint rates are limited near a singularity anyway, so a run need not end there.
    """
    rests, relaxed = True, 0
    for i in range(len(answer.rates)):
        rests = rests and abs(answer.rates[i]) <= _REST * program.limits[2, i]
    for kind in range(len(KIND_NAMES)):  # hard limits may hold as well
        relaxed += program.constraints.priority[kind] > 0 and answer.active[kind] > 0.0
    held = answer.solved and relaxed == 1 and answer.active[SINGULARITY] > 0.0
    rested_s, least = state.rested_s + program.period if rests and held else 0.0, 1.0
    if rested_s > _STALL_S:
        least = np.exp(-_YIELD_RATE * program.period)
    return ProgramState(least * state.manipulability_min, rested_s)
