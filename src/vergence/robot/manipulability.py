"""How far an arm is from singularities and joint limits, and which way leads further."""

from typing import NamedTuple

import numpy as np
from numba import njit

from vergence.arrays import FloatArray
from vergence.robot.chain import Chain, chain_state, to_tip_axes, world_jacobian


class Manipulability(NamedTuple):
    """The measure w' at one configuration, with what a law needs beside it."""

    value: float  # w'(q) = P(q) det(J Jᵀ), [Nelson1995] eq. (26)
    penalty: float  # P(q), eq. (27)
    det_JJt: float  # det(J Jᵀ), the square of Yoshikawa's measure (21)
    gradient_q: FloatArray  # (n,) ∂w'/∂q
    gradient_camera: FloatArray  # (6,) ∂w'/∂x along the camera's axes, per m and per rad
    J_camera: FloatArray  # (6, n)
    J_inverse: FloatArray  # (n, 6) damped pseudo-inverse of J_camera
    smallest_singular_value: float  # of J, bounded from below: 1/√tr((J Jᵀ)⁻¹)


def determinant_measure(J: FloatArray) -> float:
    """Return |det J| of a square Jacobian, [Nelson1995] eq. (20)."""
    return float(abs(np.linalg.det(J)))


def yoshikawa_measure(J: FloatArray) -> float:
    """Return √det(J Jᵀ) of a Jacobian (m, n) with m ≤ n, [Nelson1995] eq. (21)."""
    return float(np.sqrt(max(np.linalg.det(J @ J.T), 0.0)))


def transmissibility_measure(J: FloatArray) -> float:
    """Return √det(Jᵀ J) of a Jacobian (m, n) with m ≥ n, [Nelson1995] eq. (22)."""
    return float(np.sqrt(max(np.linalg.det(J.T @ J), 0.0)))


def relative_manipulability(J: FloatArray, a: FloatArray, d: FloatArray) -> float:
    """Return det(J Jᵀ)^(1/m) / (Σ aᵢ² + dᵢ²)^(1/n), [Nelson1995] eq. (23).

    Args:
        J: Jacobian (m, n).
        a: link lengths of Denavit and Hartenberg, (n,), m.
        d: link offsets, (n,), m.
    """
    m, n = J.shape
    size = float(np.sum(np.square(a) + np.square(d)))
    return float(max(np.linalg.det(J @ J.T), 0.0) ** (1 / m) / size ** (1 / n))


@njit(cache=True)
def joint_limit_penalty(
    q: FloatArray, q_min: FloatArray, q_max: FloatArray, k: float
) -> tuple[float, FloatArray]:
    """Return P(q) and its gradient (n,), [Nelson1995] eq. (27).

    P = 1 - exp(-k Π pᵢ), pᵢ = (qᵢ - q_min)(q_max - qᵢ)/(q_max - q_min)². Outside any limit P is 0:
    as printed it would be negative outside one limit and positive again outside two. A joint
    without limits counts as one in the middle of its range, pᵢ = 1/4.
    """
    n = len(q)
    factor, slope = np.empty(n), np.zeros(n)
    gradient = np.zeros(n)
    for i in range(n):
        span = q_max[i] - q_min[i]
        if np.isinf(span):
            factor[i] = 0.25
            continue
        factor[i] = (q[i] - q_min[i]) * (q_max[i] - q[i]) / (span * span)
        slope[i] = (q_max[i] + q_min[i] - 2.0 * q[i]) / (span * span)
        if factor[i] <= 0.0:
            return 0.0, gradient
    product = np.prod(factor)
    rest = np.exp(-k * product)
    for i in range(n):
        gradient[i] = rest * k * product * slope[i] / factor[i]
    return 1.0 - rest, gradient


@njit(cache=True)
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
    P = np.prod(term)
    for i in range(n):
        gradient[i] = P * slope[i] / term[i]
    return P, gradient


@njit(cache=True)
def invert_spd(A: FloatArray) -> tuple[FloatArray, float]:
    """Return the inverse and the determinant of a small symmetric positive definite matrix.

    Cholesky, A = G Gᵀ; a pivot at rounding level is lifted to it, so the result is always finite.
    """
    n = len(A)
    G = np.zeros((n, n))
    floor = 1e-15 * (np.trace(A) + 1e-300)
    determinant = 1.0
    for i in range(n):
        for j in range(i + 1):
            total = A[i, j]
            for k in range(j):
                total -= G[i, k] * G[j, k]
            if i == j:
                determinant *= max(total, 0.0)
                G[i, i] = np.sqrt(max(total, floor))
            else:
                G[i, j] = total / G[j, j]
    H = np.zeros((n, n))  # G⁻¹
    for j in range(n):
        H[j, j] = 1.0 / G[j, j]
        for i in range(j + 1, n):
            total = 0.0
            for k in range(j, i):
                total -= G[i, k] * H[k, j]
            H[i, j] = total / G[i, i]
    inverse = np.empty((n, n))
    for i in range(n):
        for j in range(i + 1):
            total = 0.0
            for k in range(i, n):
                total += H[k, i] * H[k, j]
            inverse[i, j] = inverse[j, i] = total
    return inverse, determinant


@njit(cache=True)
def determinant_gradient(
    J: FloatArray, X: FloatArray, determinant: float
) -> FloatArray:
    """Return ∂det(J Jᵀ)/∂q (n,), exactly, in O(n).

    J (6, n) along world axes, X = (J Jᵀ)⁻¹ J. With Jᵥᵢ, J_ωᵢ the halves of column i,
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


@njit(cache=True)
def damped_inverse(
    A: FloatArray, A_inverse: FloatArray, sigma: float, threshold: float
) -> FloatArray:
    """Return (A + λ² I)⁻¹ with λ² = threshold² (1 - σ/threshold)², or A⁻¹ where σ is above it."""
    if sigma >= threshold:
        return A_inverse
    damped = A.copy()
    for i in range(len(A)):
        damped[i, i] += (threshold - sigma) ** 2
    return invert_spd(damped)[0]


@njit(cache=True)
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
    state = chain_state(chain, q)
    J = world_jacobian(chain, state)
    A = J @ J.T
    A_inverse, det_JJt = invert_spd(A)
    sigma = 1.0 / np.sqrt(np.trace(A_inverse))
    if per_joint:
        P, gradient_P = per_joint_limit_penalty(q, q_min, q_max, k)
    else:
        P, gradient_P = joint_limit_penalty(q, q_min, q_max, k)
    gradient_det = determinant_gradient(J, A_inverse @ J, det_JJt)
    gradient_q = gradient_P * det_JJt + P * gradient_det
    X = to_tip_axes(state.R, damped_inverse(A, A_inverse, sigma, damping) @ J)
    gradient_camera = X @ gradient_q
    return Manipulability(
        P * det_JJt,
        P,
        det_JJt,
        gradient_q,
        gradient_camera,
        to_tip_axes(state.R, J),
        X.T.copy(),
        sigma,
    )
