"""Converts a quadratic to a camera twist, and that to joint rates within their limits."""

import numpy as np
from numba import njit

from vergence.arrays import FloatArray


@njit(cache=True, error_model="numpy")
def resolve_twist(
    J_inverse: FloatArray, v_camera: FloatArray, rate_max: FloatArray
) -> tuple[FloatArray, float]:
    """Return joint rates q̇ = J⁺ v_camera, scaled uniformly until none exceeds its limit.

    Uniform scaling preserves the camera's direction of motion.

    Args:
        J_inverse: (n, 6), damped near singularities.
        v_camera: (6,), m/s and rad/s.
        rate_max: (n,), rad/s or m/s.

    Returns:
        The rates (n,) and their scale in (0, 1].
    """
    rates = np.zeros(len(J_inverse))
    for i in range(len(J_inverse)):
        for j in range(len(v_camera)):
            rates[i] += J_inverse[i, j] * v_camera[j]
    return rates, slow_down(rates, rate_max)


@njit(cache=True, error_model="numpy")
def slow_down(rates: FloatArray, rate_max: FloatArray) -> float:
    """Scale rates (n,), in place, uniformly until none exceeds its limit; return the scale."""
    scale = 1.0
    for i in range(len(rates)):
        if abs(rates[i]) * scale > rate_max[i]:
            scale = rate_max[i] / abs(rates[i])
    if scale < 1.0:
        for i in range(len(rates)):
            rates[i] *= scale
    return scale


@njit(cache=True, error_model="numpy")
def twist_of(H: FloatArray, g: FloatArray) -> FloatArray:
    """Return the twist H⁻¹ g, (6,); it is 0 along axes that no objective controls.

    Args:
        H: positive semi-definite, (6, 6); the row of an axis that no objective controls is 0.
        g: (6,).
    """
    A = H.copy()
    for i in range(6):
        if A[i, i] == 0.0:
            A[i, i] = 1.0
    return np.linalg.solve(A, g).astype(np.float64)
