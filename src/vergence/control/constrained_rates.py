"""One tick of the constrained servo: an objective and what is kept, in; joint rates, out."""

from typing import NamedTuple

import numpy as np
from numba import njit

from vergence.arrays import FloatArray
from vergence.control.active_set import solve_ordered_qp
from vergence.control.constraints import KIND_NAMES, ConstraintSettings, constraint_rows
from vergence.control.sight_lines import sight_rows
from vergence.robot import Chain, forward_kinematics, manipulability
from vergence.robot.manipulability import determinant_gradient
from vergence.robot.positive_definite import invert_spd_any

_KINDS = len(KIND_NAMES)


class Avoidance(NamedTuple):
    """How the objective prefers good configurations; packed for the kernel."""

    S: float  # on 1/w', [Nelson1995] eq. (28)
    rate_max: float  # the joint rates it alone may cause, ‖q̇‖, rad/s
    penalty_k: float  # steepness of the joint penalty, taken joint by joint
    damping: float  # on the joint rates, so that the program has one solution


class ConstrainedRates(NamedTuple):
    """One tick's answer."""

    rates: FloatArray  # (n,)
    v_camera: FloatArray  # (6,) what they do to the camera, m/s and rad/s
    manipulability: float  # w'
    penalty: float  # P
    active: FloatArray  # (K,) by kind of constraint: how many rows push
    given_up: FloatArray  # (K,) by kind: the largest violation, in the row's own unit
    solved: bool


@njit(cache=True, error_model="numpy")
def constrained_rates(
    chain: Chain,
    limits: FloatArray,
    q: FloatArray,
    velocity: FloatArray,
    H_twist: FloatArray,
    g_twist: FloatArray,
    spare: FloatArray,
    features: FloatArray,
    solids: FloatArray,
    period: float,
    settings: ConstraintSettings,
    avoidance: Avoidance,
) -> ConstrainedRates:
    """Return the joint rates that serve a twist objective best within every constraint.

    Minimise ½ vᵀ H v - gᵀ v + μ/2 ‖q̇ - spare‖² + S/2 · 1/w'(q + T q̇) with v = J q̇, the last
    term linearised, subject to the rows of `constraint_rows`. If the program is not solved, the arm
    brakes as fast as it may.

    Args:
        chain: up to the camera.
        limits: rows q_min, q_max, rate_max, acceleration_max, (4, n).
        q: joint positions, (n,).
        velocity: joint rates now, (n,).
        H_twist: of the objective, (6, 6).
        g_twist: of the objective, (6,).
        spare: rates wanted of the joints where the objective leaves a choice, (n,).
        features: of `pack_features`, (M, 7).
        solids: what may come between, (K, 16), see `sight_lines`.
        period: how long the command will act, s.
        settings: what is kept.
        avoidance: how good configurations are preferred.
    """
    n = len(q)
    m = manipulability(chain, q, limits[0], limits[1], avoidance.penalty_k, True, 1e-3)
    J = m.J_camera
    H, g = joint_objective(H_twist, g_twist, J, avoidance.damping)
    for i in range(n):
        g[i] += avoidance.damping * spare[i]
    H_inverse, _ = invert_spd_any(H)
    if avoidance.S > 0.0 and m.value > 0.0:
        pull = avoidance.S * period * period / (2.0 * m.value * m.value) * m.gradient_q
        rate = H_inverse @ pull
        size = np.sqrt(np.sum(rate * rate))
        g += pull * min(1.0, avoidance.rate_max / max(size, 1e-300))
    yoshikawa = np.sqrt(m.det_JJt)
    slope = determinant_gradient(J, m.J_inverse.T.copy(), m.det_JJt) / (2.0 * max(yoshikawa, 1e-9))
    C_sight, d_sight = np.empty((0, n)), np.empty(0)
    if len(solids):
        T = forward_kinematics(chain, q)
        C_sight, d_sight = sight_rows(
            T, J, features, solids, settings.clearance, settings.approach_rate
        )
    rows = constraint_rows(
        q, velocity, limits, period, J, features, C_sight, d_sight, yoshikawa, slope, settings
    )
    rank = np.empty(len(rows.d), dtype=np.int64)
    for i in range(len(rank)):
        rank[i] = settings.rank[rows.kind[i]]
    solution = solve_ordered_qp(H_inverse, g, rows.C, rows.d, rank)
    active, given_up = np.zeros(_KINDS), np.zeros(_KINDS)
    for i in range(len(rank)):
        kind = rows.kind[i]
        active[kind] += solution.active[i]
        if rank[i] > 0:  # hard rows hold exactly: what the solver's rounding leaves is cut off
            given_up[kind] = max(given_up[kind], solution.given_up[i])
    rates = solution.x
    for i in range(n):  # the solver's rounding must not pass a hard bound either
        rates[i] = min(max(rates[i], rows.d[2 * i + 1]), -rows.d[2 * i])
    solved = solution.solved and bool(np.isfinite(rates).all())
    if not solved:
        rates = velocity - np.minimum(np.maximum(velocity, -limits[3] * period), limits[3] * period)
    return ConstrainedRates(rates, J @ rates, m.value, m.penalty, active, given_up, solved)


@njit(cache=True, error_model="numpy")
def joint_objective(
    H_twist: FloatArray, g_twist: FloatArray, J: FloatArray, damping: float
) -> tuple[FloatArray, FloatArray]:
    """Return Jᵀ H J + μ I (n, n) and Jᵀ g (n,): a twist objective in joint rates."""
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
        H[j, j] += damping
    return H, g
