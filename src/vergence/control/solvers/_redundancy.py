"""Converts a desired twist of the arm's tip to joint rates, for six, seven and more joints."""

import numpy as np
from numba import njit

from vergence.arrays import FloatArray


@njit(cache=True)
def resolve_redundant(
    J: FloatArray,
    twist: FloatArray,
    null_space_rates: FloatArray,
    rate_max: FloatArray,
    singular_below: float,
) -> FloatArray:
    """Return joint rates for a twist of the tip, with other rates projected into the null space.

    With W = diag(rate_max), J W = U Σ Vᵀ and y = W⁻¹ q̇:

        y = V diag(σᵢ / max(σᵢ, σ₀)²) Uᵀ twist + (I - V Vᵀ) W⁻¹ q̇_null.

    Weighting by the rate limits makes metres and radians, slow and fast joints comparable. Only
    directions with a singular value below σ₀ are damped. All rates are scaled uniformly until none
    exceeds its limit, which preserves the tip's direction of motion.

    Args:
        J: Jacobian of the tip (6, n) in its own frame.
        twist: desired, in the same frame, (6,), m/s and rad/s.
        null_space_rates: desired in the null space, (n,).
        rate_max: (n,), rad/s or m/s.
        singular_below: σ₀, relative to the largest singular value.
    """
    U, sigma, Vt = np.linalg.svd(np.ascontiguousarray(J * rate_max), False)
    least = singular_below * sigma[0]
    y = np.zeros(len(rate_max))
    desired = null_space_rates / rate_max
    left = desired.copy()
    for i in range(len(sigma)):
        along, null_along = 0.0, 0.0
        for r in range(6):
            along += U[r, i] * twist[r]
        for j in range(len(y)):
            null_along += Vt[i, j] * desired[j]
        gain = along * sigma[i] / max(sigma[i], least) ** 2
        for j in range(len(y)):
            y[j] += gain * Vt[i, j]
            left[j] -= null_along * Vt[i, j]
    y += left
    slow = max(1.0, np.max(np.abs(y)))
    rates: FloatArray = rate_max * y / slow
    return rates
