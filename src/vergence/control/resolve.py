"""From a camera twist to joint rates."""

import numpy as np
from numba import njit

from vergence.arrays import FloatArray


@njit(cache=True)
def resolve_twist(
    J_inverse: FloatArray, v_camera: FloatArray, rate_max: FloatArray
) -> tuple[FloatArray, float]:
    """Return joint rates q̇ = J⁺ v_camera, slowed as a whole until none exceeds its limit.

    Slowing all joints alike keeps the camera on its course.

    Args:
        J_inverse: (n, 6), damped near singularities.
        v_camera: (6,), m/s and rad/s.
        rate_max: (n,), rad/s or m/s.

    Returns:
        The rates (n,) and the scale in (0, 1] they were slowed by.
    """
    rates = J_inverse @ v_camera
    scale = 1.0
    for i in range(len(rates)):
        scale = min(scale, rate_max[i] / max(abs(rates[i]), 1e-300))
    return rates * scale, scale
