"""How far an arm is from singularities and joint limits, and which way leads further.

Kernels that take or return a container are inlined into the tick that calls them: handing a
container of arrays on costs as much as the arithmetic of a joint.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from vergence.arrays import FloatArray
from vergence.robot.chain import Chain, axis_jacobian, jacobian, joint_columns
from vergence.robot.positive_definite import (
    invert_spd,
    invert_spd_any,
    outer_square,
    times_six,
)


class Manipulability(NamedTuple):
    """The measure w' at one configuration, with what a law needs beside it."""

    value: float  # w'(q) = P(q) det(J Jᵀ), [Nelson1995] eq. (26)
    penalty: float  # P(q), eq. (27)
    det_JJt: float  # det(J Jᵀ), the square of (21); det(Jᵀ J) of (22) with fewer than six joints
    gradient_q: FloatArray  # (n,) ∂w'/∂q
    gradient_camera: FloatArray  # (6,) ∂w'/∂x along the camera's axes, per m and per rad
    J_camera: FloatArray  # (6, n)
    J_inverse: FloatArray  # (n, 6) damped pseudo-inverse of J_camera
    smallest_singular_value: float  # of J, bounded from below: 1/√tr((J Jᵀ)⁻¹)


def yoshikawa_measure(J: FloatArray) -> float:
    """Return √det(J Jᵀ) of a Jacobian (m, n) with m ≤ n, [Nelson1995] eq. (21)."""
    return float(np.sqrt(max(np.linalg.det(J @ J.T), 0.0)))


def transmissibility_measure(J: FloatArray) -> float:
    """Return √det(Jᵀ J) of a Jacobian (m, n) with m ≥ n, [Nelson1995] eq. (22)."""
    return float(np.sqrt(max(np.linalg.det(J.T @ J), 0.0)))


def manipulability_measure(J: FloatArray) -> float:
    """Return (21), or (22) where the arm has fewer joints than the Jacobian (m, n) has rows."""
    return yoshikawa_measure(J) if J.shape[1] >= J.shape[0] else transmissibility_measure(J)


@njit(cache=True, error_model="numpy")
def joint_limit_penalty(
    q: FloatArray, q_min: FloatArray, q_max: FloatArray, k: float
) -> tuple[float, FloatArray]:
    """Return P(q) and its gradient (n,), [Nelson1995] eq. (27).

    P = 1 - exp(-k Π pᵢ), pᵢ = (qᵢ - q_min)(q_max - qᵢ)/(q_max - q_min)². Outside any limit P is 0:
    as printed it would be negative outside one limit and positive again outside two. A joint
    without limits counts as one in the middle of its range, pᵢ = 1/4.
    """
    n = len(q)
    gradient = np.zeros(n)
    product = 1.0
    for i in range(n):
        span = q_max[i] - q_min[i]
        if span == np.inf:
            product *= 0.25
            continue
        below, above = q[i] - q_min[i], q_max[i] - q[i]
        if below <= 0.0 or above <= 0.0:
            gradient[:] = 0.0
            return 0.0, gradient
        gradient[i] = (above - below) / (below * above)  # (log pᵢ)'
        product *= below * above / (span * span)
    rest = float(np.exp(-k * product))
    for i in range(n):
        gradient[i] *= rest * k * product
    return 1.0 - rest, gradient


@njit(cache=True, error_model="numpy")
def per_joint_limit_penalty(
    q: FloatArray, q_min: FloatArray, q_max: FloatArray, k: float
) -> tuple[float, FloatArray]:
    """Return P(q) = Π (1 - exp(-k pᵢ)) and its gradient (n,).

    The product in (27) is small whenever several joints are merely off-centre. Here each joint is
    penalised for its own distance alone, and P is near 1 wherever every joint is well inside.
    """
    n = len(q)
    term, slope = np.ones(n), np.zeros(n)
    gradient = np.zeros(n)
    for i in range(n):
        span = q_max[i] - q_min[i]
        if np.isinf(span):
            continue
        p = (q[i] - q_min[i]) * (q_max[i] - q[i]) / (span * span)
        if p <= 0.0:
            return 0.0, gradient
        rest = np.exp(-k * p)
        term[i] = 1.0 - rest
        slope[i] = k * rest * (q_max[i] + q_min[i] - 2.0 * q[i]) / (span * span)
    P = float(np.prod(term))
    for i in range(n):
        gradient[i] = P * slope[i] / term[i]
    return P, gradient


class Posture(NamedTuple):
    """An arm at one configuration: what the laws and measures build on."""

    J: FloatArray  # (6, n) of the tip, in its own frame: v_tip = J q̇
    inverse: FloatArray  # (6, 6) (J Jᵀ)⁻¹; with fewer than six joints the pseudo-inverse
    damped: FloatArray  # (6, 6) (J Jᵀ + λ² I)⁻¹; the inverse itself away from singularities
    det_JJt: float  # det(J Jᵀ), or det(Jᵀ J) with fewer than six joints
    sigma: float  # smallest singular value of J, bounded from below: 1/√tr((J Jᵀ)⁺)


@njit(cache=True, error_model="numpy", inline="always")
def posture(chain: Chain, q: FloatArray, damping: float) -> Posture:
    """Return the arm's Jacobian at q (n,), with what its inverse and determinant need.

    Where σ < damping, λ² = (damping - σ)²: the inverse stays bounded through a singularity.
    """
    J = jacobian(chain, q)
    A = outer_square(J)
    inverse, det_JJt = invert_spd(A) if J.shape[1] >= 6 else pseudo_invert_square(J)
    trace = 0.0
    for i in range(6):
        trace += inverse[i, i]
    sigma = 1.0 / np.sqrt(trace)
    damped = inverse
    if sigma < damping:
        for i in range(6):
            A[i, i] += (damping - sigma) ** 2
        damped = invert_spd(A)[0]
    return Posture(J, inverse, damped, det_JJt, sigma)


@njit(cache=True, error_model="numpy")
def pseudo_invert_square(J: FloatArray) -> tuple[FloatArray, float]:
    """Return (J Jᵀ)⁺ = J (Jᵀ J)⁻² Jᵀ (6, 6) and det(Jᵀ J) of J (6, n) with n < 6."""
    n = J.shape[1]
    inner = np.zeros((n, n))
    for i in range(n):
        for j in range(n):
            for r in range(6):
                inner[i, j] += J[r, i] * J[r, j]
    inverse, determinant = invert_spd_any(inner)
    X = np.zeros((6, n))
    for r in range(6):
        for i in range(n):
            for j in range(n):
                X[r, i] += J[r, j] * inverse[j, i]
    return outer_square(X), determinant


@njit(cache=True, error_model="numpy")
def pseudo_inverse_transposed(inverse: FloatArray, J: FloatArray) -> FloatArray:
    """Return X = (J Jᵀ)⁺ J (6, n), the transpose of J⁺."""
    X = np.empty(J.shape)
    for i in range(J.shape[1]):
        for r in range(6):
            total = 0.0
            for c in range(6):
                total += inverse[r, c] * J[c, i]
            X[r, i] = total
    return X


@njit(cache=True, error_model="numpy")
def determinant_gradient(J: FloatArray, X: FloatArray, determinant: float) -> FloatArray:
    """Return ∂det(J Jᵀ)/∂q (n,), exactly, in O(n), of a chain without coupling.

    J (6, n) in the tip's frame, X = (J Jᵀ)⁻¹ J (6, n). With Jᵥᵢ, J_ωᵢ the halves of column i,
    ∂Jᵢ/∂qⱼ is (J_ωⱼ × Jᵥᵢ, J_ωⱼ × J_ωᵢ) for j < i and (J_ωᵢ × Jᵥⱼ, 0) for j ≥ i, so
    ∂det/∂qⱼ = 2 det [J_ωⱼ · Σ_{i>j} (Jᵥᵢ × Xᵥᵢ + J_ωᵢ × X_ωᵢ) + Jᵥⱼ · Σ_{i≤j} (Xᵥᵢ × J_ωᵢ)].
    """
    n = J.shape[1]
    gradient = np.zeros(n)
    s0 = s1 = s2 = 0.0
    for j in range(n - 1, -1, -1):
        gradient[j] += J[3, j] * s0 + J[4, j] * s1 + J[5, j] * s2
        for h in (0, 3):
            s0 += J[h + 1, j] * X[h + 2, j] - J[h + 2, j] * X[h + 1, j]
            s1 += J[h + 2, j] * X[h, j] - J[h, j] * X[h + 2, j]
            s2 += J[h, j] * X[h + 1, j] - J[h + 1, j] * X[h, j]
    s0 = s1 = s2 = 0.0
    for j in range(n):
        s0 += X[1, j] * J[5, j] - X[2, j] * J[4, j]
        s1 += X[2, j] * J[3, j] - X[0, j] * J[5, j]
        s2 += X[0, j] * J[4, j] - X[1, j] * J[3, j]
        gradient[j] += J[0, j] * s0 + J[1, j] * s1 + J[2, j] * s2
        gradient[j] *= 2.0 * determinant
    return gradient


@njit(cache=True, error_model="numpy")
def coupled_determinant_gradient(
    chain: Chain, q: FloatArray, X: FloatArray, determinant: float
) -> FloatArray:
    """Return ∂det(J Jᵀ)/∂q (n,) of a coupled chain at q, X = (J Jᵀ)⁻¹ J (6, n).

    A joint of several axes is weighed by its ratios twice: in X and in the sum over its axes.
    """
    m = len(chain.coupling)
    J_axes, X_axes = axis_jacobian(chain, q), np.empty((6, m))
    for i in range(m):
        j, ratio = int(chain.coupling[i, 0]), chain.coupling[i, 1]
        for r in range(6):
            X_axes[r, i] = ratio * X[r, j]
    by_axis = determinant_gradient(J_axes, X_axes, determinant)
    gradient: FloatArray = joint_columns(chain, by_axis.reshape(1, m), len(q))[0]
    return gradient


@njit(cache=True, error_model="numpy")
def limit_penalty(
    q: FloatArray, q_min: FloatArray, q_max: FloatArray, k: float, per_joint: bool
) -> tuple[float, FloatArray]:
    """Return P(q) and its gradient (n,): (27), or its form joint by joint."""
    if per_joint:
        return per_joint_limit_penalty(q, q_min, q_max, k)
    return joint_limit_penalty(q, q_min, q_max, k)


@njit(cache=True, error_model="numpy", inline="always")
def determinant_slope(chain: Chain, q: FloatArray, arm: Posture) -> FloatArray:
    """Return ∂det(J Jᵀ)/∂q (n,) of any chain at q, exactly."""
    X = pseudo_inverse_transposed(arm.inverse, arm.J)
    if len(chain.coupling) == 0:
        return determinant_gradient(arm.J, X, arm.det_JJt)
    return coupled_determinant_gradient(chain, q, X, arm.det_JJt)


@njit(cache=True, error_model="numpy", inline="always")
def measure_gradient(
    arm: Posture, slope: FloatArray, P: float, gradient_P: FloatArray
) -> FloatArray:
    """Return ∂w'/∂q (n,) of w' = P det(J Jᵀ), given ∂det(J Jᵀ)/∂q and ∂P/∂q (n,)."""
    gradient = np.empty(len(slope))
    for i in range(len(gradient)):
        gradient[i] = P * slope[i] + gradient_P[i] * arm.det_JJt
    return gradient


@njit(cache=True, error_model="numpy", inline="always")
def camera_gradient(arm: Posture, gradient_q: FloatArray) -> FloatArray:
    """Return ∂w'/∂x (6,) along the tip's own axes: (J⁺)ᵀ ∂w'/∂q = (J Jᵀ)⁻¹ J ∂w'/∂q."""
    moved = np.zeros(6)
    for i in range(len(gradient_q)):
        for r in range(6):
            moved[r] += arm.J[r, i] * gradient_q[i]
    return times_six(arm.damped, moved)


@njit(cache=True, error_model="numpy", inline="always")
def joint_rates(arm: Posture, v_tip: FloatArray) -> FloatArray:
    """Return q̇ = J⁺ v_tip (n,), damped near singularities; v_tip (6,) in the tip's own frame."""
    y = times_six(arm.damped, v_tip)
    rates = np.empty(arm.J.shape[1])
    for i in range(len(rates)):
        total = 0.0
        for r in range(6):
            total += arm.J[r, i] * y[r]
        rates[i] = total
    return rates


@njit(cache=True, error_model="numpy")
def manipulability(
    chain: Chain,
    q: FloatArray,
    q_min: FloatArray,
    q_max: FloatArray,
    k: float,
    per_joint: bool,
    damping: float,
) -> Manipulability:
    """Return w' (26) at q with its exact gradient, and the camera Jacobian with its inverse.

    Args:
        chain: the arm up to its camera.
        q: joint positions, (n,).
        q_min: lower limits, (n,), -inf where there is none.
        q_max: upper limits, (n,), inf where there is none.
        k: steepness of the penalty; about 1e5 for the product of (27), about 50 per joint.
        per_joint: penalise each joint for itself instead of the product of (27).
        damping: smallest singular value of J below which its inverse is damped.
    """
    arm = posture(chain, q, damping)
    P, gradient_P = limit_penalty(q, q_min, q_max, k, per_joint)
    slope = determinant_slope(chain, q, arm)
    gradient_q = measure_gradient(arm, slope, P, gradient_P)
    return Manipulability(
        P * arm.det_JJt,
        P,
        arm.det_JJt,
        gradient_q,
        camera_gradient(arm, gradient_q),
        arm.J,
        pseudo_inverse_transposed(arm.damped, arm.J).T.copy(),
        arm.sigma,
    )
