"""One tick of the quadratic program: joint rates from objectives and limits."""

from typing import NamedTuple

import numpy as np
from numba import njit

from vergence.arrays import FloatArray, IntArray
from vergence.control.limits._rows import KIND_NAMES, ConstraintSettings, constraint_rows
from vergence.control.limits.occlusion import sight_rows
from vergence.control.solvers._active_set import solve_ordered_qp
from vergence.robot import Chain, forward_kinematics
from vergence.robot.manipulability import (
    determinant_slope,
    limit_penalty,
    measure_gradient,
    posture,
)
from vergence.robot.positive_definite import invert_spd_any

HARD_AND_BUILT_IN = len(KIND_NAMES)


class Avoidance(NamedTuple):
    """The preference of the program for good configurations; packed for the kernel."""

    S: float  # weight of 1/w', [Nelson1995] eq. (28)
    rate_max: float  # limit on the joint rates it causes by itself, ‖q̇‖, rad/s
    penalty_k: float  # steepness of the joint penalty, evaluated per joint


class Task(NamedTuple):
    """The objectives for the arm."""

    H: FloatArray  # (6, 6) of the twist of the arm's tip
    g: FloatArray  # (6,)
    H_joints: FloatArray  # (n, n) of the joint rates; (0, 0) for none
    g_joints: FloatArray  # (n,); (0,) for none
    null_space_rates: FloatArray  # (n,) desired where the objectives leave freedom
    damping: FloatArray  # (n,) μ, their weight; positive, so that the solution is unique


class Scene(NamedTuple):
    """The data of the limits about the camera's view, and a user's own limits."""

    features: FloatArray  # from `pack_features`, (M, 7)
    solids: FloatArray  # (K, 16) that may occlude features, see `occlusion`
    A: FloatArray  # (6, 6) with v_camera = A v_tip; (0, 0) for a camera at the tip
    T_tip_camera: FloatArray  # (4, 4) of a camera on the arm, for the solids
    C: FloatArray  # (r, n) rows of a user's own limits, C q̇ ≥ d
    d: FloatArray  # (r,)
    kind: IntArray  # (r,) kind of limit of each row


class ConstrainedRates(NamedTuple):
    """The result of one tick."""

    rates: FloatArray  # (n,)
    v_tip: FloatArray  # (6,) resulting twist of the arm's tip, m/s and rad/s
    manipulability: float  # w'
    penalty: float  # P
    active: FloatArray  # (K,) by kind of limit: number of active rows
    slack: FloatArray  # (K,) by kind: the largest slack, in the row's own unit
    solved: bool


@njit(cache=True, error_model="numpy")
def constrained_rates(
    chain: Chain,
    limits: FloatArray,
    q: FloatArray,
    velocity: FloatArray,
    task: Task,
    scene: Scene,
    period: float,
    settings: ConstraintSettings,
    avoidance: Avoidance,
) -> ConstrainedRates:
    """Return the joint rates that best serve the objectives within every limit.

    Minimise ½ vᵀ H v - gᵀ v + ½ q̇ᵀ H_q q̇ - g_qᵀ q̇ + ½ Σ μ (q̇ - q̇_null)² + S/2 · 1/w'(q + T q̇)
    with v = J q̇, the last term linearised, subject to the rows of `constraint_rows` and a user's
    own. If the program is not solved, the arm brakes as fast as its limits allow.

    Args:
        chain: up to the tip.
        limits: rows q_min, q_max, rate_max, acceleration_max, (4, n).
        q: joint positions, (n,).
        velocity: joint rates now, (n,).
        task: the objectives.
        scene: the camera's view.
        period: time for which the command acts, s.
        settings: margins and priorities of the limits.
        avoidance: preference for good configurations.
    """
    n = len(q)
    arm = posture(chain, q, 1e-3)
    P, slope_P = limit_penalty(q, limits[0], limits[1], avoidance.penalty_k, True)
    slope, w, J = determinant_slope(chain, q, arm), P * arm.det_JJt, arm.J
    H, g = joint_objective(task.H, task.g, J, task.damping)
    for i in range(n):
        g[i] += task.damping[i] * task.null_space_rates[i]
    if len(task.g_joints):
        H += task.H_joints
        g += task.g_joints
    H_inverse, _ = invert_spd_any(H)
    if avoidance.S > 0.0 and w > 0.0:
        pull = measure_gradient(arm, slope, P, slope_P)
        pull *= avoidance.S * period * period / (2.0 * w * w)
        rate = H_inverse @ pull
        size = np.sqrt(np.sum(rate * rate))
        g += pull * min(1.0, avoidance.rate_max / max(size, 1e-300))
    yoshikawa = np.sqrt(arm.det_JJt)
    slope /= 2.0 * max(yoshikawa, 1e-9)
    J_camera = J if len(scene.A) == 0 else scene.A @ J
    C_sight, d_sight = np.empty((0, n)), np.empty(0)
    if len(scene.solids):
        T = forward_kinematics(chain, q) @ scene.T_tip_camera
        C_sight, d_sight = sight_rows(
            T, J_camera, scene.features, scene.solids, settings.clearance, settings.approach_rate
        )
    rows = constraint_rows(
        q, velocity, limits, period, J_camera, scene.features, C_sight, d_sight, yoshikawa, slope,
        settings,
    )  # fmt: skip
    C, d, kind = rows.C, rows.d, rows.kind
    if len(scene.d):
        C = np.concatenate((C, scene.C))
        d = np.concatenate((d, scene.d))
        kind = np.concatenate((kind, scene.kind))
    priority = np.empty(len(d), dtype=np.int64)
    for i in range(len(priority)):
        priority[i] = settings.priority[kind[i]]
    solution = solve_ordered_qp(H_inverse, g, C, d, priority)
    active, slack = np.zeros(len(settings.priority)), np.zeros(len(settings.priority))
    for i in range(len(priority)):
        active[kind[i]] += solution.active[i]
        if priority[i] > 0:  # hard rows hold exactly: the solver's rounding is ignored
            slack[kind[i]] = max(slack[kind[i]], solution.slack[i])
    rates = solution.x
    for i in range(n):  # nor may the solver's rounding violate a hard bound
        rates[i] = min(max(rates[i], d[2 * i + 1]), -d[2 * i])
    solved = solution.solved and bool(np.isfinite(rates).all())
    if not solved:
        rates = velocity - np.minimum(np.maximum(velocity, -limits[3] * period), limits[3] * period)
    return ConstrainedRates(rates, J @ rates, w, P, active, slack, solved)


@njit(cache=True, error_model="numpy")
def joint_objective(
    H_twist: FloatArray, g_twist: FloatArray, J: FloatArray, damping: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return Jᵀ H J + diag(μ) (n, n) and Jᵀ g (n,): a twist objective in joint rates."""
    n = J.shape[1]
    H, g, HJ = np.zeros((n, n)), np.zeros(n), np.zeros(6)
    for j in range(n):
        for r in range(6):
            HJ[r] = 0.0
            for k in range(6):
                HJ[r] += H_twist[r, k] * J[k, j]
            g[j] += J[r, j] * g_twist[r]
        for i in range(j + 1):
            for r in range(6):
                H[i, j] += J[r, i] * HJ[r]
            H[j, i] = H[i, j]
        H[j, j] += damping[j]
    return H, g
