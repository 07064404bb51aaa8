"""Rotations as matrices and as rotation vectors w = axis · angle."""

import numpy as np
from numba import njit

from vergence.arrays import FloatArray
from vergence.geometry.quaternion import matrix_to_quaternion

# Below this squared angle the closed forms lose digits; four terms of their series do not.
SMALL_ANGLE_SQUARED = 1e-2


@njit(cache=True)
def skew(w: FloatArray) -> FloatArray:
    """Return [w], (3, 3), with [w] p = w × p."""
    S = np.zeros((3, 3))
    S[0, 1], S[0, 2] = -w[2], w[1]
    S[1, 0], S[1, 2] = w[2], -w[0]
    S[2, 0], S[2, 1] = -w[1], w[0]
    return S


@njit(cache=True)
def _polynomial(w: FloatArray, a: float, b: float) -> FloatArray:
    """Return I + a [w] + b [w]², with [w]² = w wᵀ - |w|² I."""
    square = w[0] * w[0] + w[1] * w[1] + w[2] * w[2]
    M = np.empty((3, 3))
    for i in range(3):
        for j in range(3):
            M[i, j] = b * w[i] * w[j]
        M[i, i] += 1.0 - b * square
    M[0, 1] -= a * w[2]
    M[0, 2] += a * w[1]
    M[1, 0] += a * w[2]
    M[1, 2] -= a * w[0]
    M[2, 0] -= a * w[1]
    M[2, 1] += a * w[0]
    return M


@njit(cache=True)
def _angle_squared(w: FloatArray) -> float:
    square: float = w[0] * w[0] + w[1] * w[1] + w[2] * w[2]
    return square


@njit(cache=True)
def _sine_ratio(s: float) -> float:
    """Return sin θ / θ of s = θ²."""
    if s < SMALL_ANGLE_SQUARED:
        return 1.0 - s / 6.0 * (1.0 - s / 20.0 * (1.0 - s / 42.0 * (1.0 - s / 72.0)))
    angle = np.sqrt(s)
    ratio: float = np.sin(angle) / angle
    return ratio


@njit(cache=True)
def _cosine_ratio(s: float) -> float:
    """Return (1 - cos θ) / θ² of s = θ², by the half angle."""
    half = _sine_ratio(0.25 * s)
    return 0.5 * half * half


@njit(cache=True)
def _cubic_ratio(s: float) -> float:
    """Return (θ - sin θ) / θ³ of s = θ²."""
    if s < SMALL_ANGLE_SQUARED:
        return (1.0 - s / 20.0 * (1.0 - s / 42.0 * (1.0 - s / 72.0 * (1.0 - s / 110.0)))) / 6.0
    return (1.0 - _sine_ratio(s)) / s


@njit(cache=True)
def _cotangent_ratio(s: float) -> float:
    """Return (1 - θ/2 · cot θ/2) / θ² of s = θ²."""
    if s < SMALL_ANGLE_SQUARED:
        return (1.0 + s / 60.0 * (1.0 + s / 42.0 * (1.0 + s / 40.0))) / 12.0
    half = 0.5 * np.sqrt(s)
    ratio: float = (1.0 - half * np.cos(half) / np.sin(half)) / s
    return ratio


@njit(cache=True)
def so3_exp(w: FloatArray) -> FloatArray:
    """Return the rotation matrix of a rotation vector (Rodrigues).

    R = I + sin θ/θ [w] + (1 - cos θ)/θ² [w]², θ = |w|.

    Args:
        w: rotation vector, (3,), rad.
    """
    s = _angle_squared(w)
    return _polynomial(w, _sine_ratio(s), _cosine_ratio(s))


@njit(cache=True)
def so3_log(R: FloatArray) -> FloatArray:
    """Return the rotation vector (3,), |w| <= π, of a rotation matrix (3, 3).

    By the unit quaternion, w = 2 atan2(|v|, q_w) v/|v|, which keeps all its digits near the
    identity and near half a turn. At half a turn exactly, either axis may come back.
    """
    q = matrix_to_quaternion(R)
    sine = np.sqrt(q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    scale = 2.0 * np.arctan2(sine, q[0]) / sine if sine > 1e-150 else 2.0
    w: FloatArray = scale * q[1:]
    return w


def so3_angle(R: FloatArray) -> float:
    """Return the angle of a rotation (3, 3), or of that of a pose (4, 4), rad."""
    return float(np.linalg.norm(so3_log(np.array(R, order="C"))))


def angle_between(R_a: FloatArray, R_b: FloatArray) -> float:
    """Return the angle of R_aᵀ R_b, rad, for rotations (3, 3) or poses (4, 4)."""
    return so3_angle(R_a[:3, :3].T @ R_b[:3, :3])


@njit(cache=True)
def so3_left_jacobian(w: FloatArray) -> FloatArray:
    """Return J with exp(w + dw) = exp(J dw) exp(w) to first order.

    J = I + (1 - cos θ)/θ² [w] + (θ - sin θ)/θ³ [w]².

    Args:
        w: rotation vector, (3,), rad.
    """
    s = _angle_squared(w)
    return _polynomial(w, _cosine_ratio(s), _cubic_ratio(s))


@njit(cache=True)
def so3_left_jacobian_inverse(w: FloatArray) -> FloatArray:
    """Return J⁻¹ = I - [w]/2 + (1 - θ/2 · cot θ/2)/θ² [w]², for |w| < 2π.

    Args:
        w: rotation vector, (3,), rad.
    """
    return _polynomial(w, -0.5, _cotangent_ratio(_angle_squared(w)))


@njit(cache=True)
def nearest_rotation(M: FloatArray) -> FloatArray:
    """Return the rotation (3, 3) nearest to a matrix in the least-squares sense.

    U diag(1, 1, det U Vᵀ) Vᵀ of M = U S Vᵀ.
    """
    U, _, Vt = np.linalg.svd(M)
    sign = 1.0 if np.linalg.det(U) * np.linalg.det(Vt) > 0.0 else -1.0
    R = np.empty((3, 3))
    for i in range(3):
        for j in range(3):
            R[i, j] = U[i, 0] * Vt[0, j] + U[i, 1] * Vt[1, j] + sign * U[i, 2] * Vt[2, j]
    return R
