"""The motion model: constant velocity of the target's origin and constant angular velocity.

    p' = p + v dt,  R' = exp(ω dt) R,  v' = v,  ω' = ω,

driven by white acceleration, so that the model holds for any step and two half steps are one.
"""

import numpy as np
from numba import njit

from vergence.arrays import FloatArray
from vergence.geometry import so3_left_jacobian
from vergence.kernels.scratch import scratch


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def predict_covariance(
    P: FloatArray, velocity: FloatArray, dt: float, density: FloatArray
) -> FloatArray:
    """Return F P Fᵀ + Q, (12, 12), of the error (δp, δθ, δv, δω).

    δp' = δp + dt δv,  δθ' = exp(ω dt) δθ + dt J(ω dt) δω, J the left Jacobian of SO(3);
    Q = d [[dt³/3, dt²/2], [dt²/2, dt]] for each axis with d its acceleration density.

    Args:
        P: covariance, (12, 12).
        velocity: (v, ω), (6,), world axes.
        dt: s; negative is not meant.
        density: of linear and angular acceleration, (2,), m²/s³ and rad²/s³.
    """
    w = scratch(1, 3)[0]
    for i in range(3):
        w[i] = dt * velocity[3 + i]
    J = so3_left_jacobian(w)
    E = scratch(3, 3)  # exp(w) = I + [w] J
    for j in range(3):
        E[0, j] = w[1] * J[2, j] - w[2] * J[1, j]
        E[1, j] = w[2] * J[0, j] - w[0] * J[2, j]
        E[2, j] = w[0] * J[1, j] - w[1] * J[0, j]
        E[j, j] += 1.0
    PFt = scratch(12, 12)
    predicted = np.empty((12, 12))
    _advance(P, E, J, dt, PFt.T)
    _advance(PFt, E, J, dt, predicted)
    for i in range(6):
        d = density[i // 3]
        predicted[i, i] += d * dt * dt * dt / 3.0
        predicted[i, 6 + i] += d * dt * dt / 2.0
        predicted[6 + i, 6 + i] += d * dt
    for i in range(12):
        for j in range(i):
            predicted[i, j] = predicted[j, i]
    return predicted


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def _advance(P: FloatArray, E: FloatArray, J: FloatArray, dt: float, out: FloatArray) -> None:
    """Fill `out` with F P, (12, 12).

    Written out in one loop, the compiler works on four columns at once.
    """
    e00, e01, e02, e10, e11 = E[0, 0], E[0, 1], E[0, 2], E[1, 0], E[1, 1]
    e12, e20, e21, e22 = E[1, 2], E[2, 0], E[2, 1], E[2, 2]
    b00, b01, b02, b10, b11 = dt * J[0, 0], dt * J[0, 1], dt * J[0, 2], dt * J[1, 0], dt * J[1, 1]
    b12, b20, b21, b22 = dt * J[1, 2], dt * J[2, 0], dt * J[2, 1], dt * J[2, 2]
    for j in range(12):
        x, y, z = P[3, j], P[4, j], P[5, j]
        u, v, w = P[9, j], P[10, j], P[11, j]
        out[0, j] = P[0, j] + dt * P[6, j]
        out[1, j] = P[1, j] + dt * P[7, j]
        out[2, j] = P[2, j] + dt * P[8, j]
        out[3, j] = e00 * x + e01 * y + e02 * z + b00 * u + b01 * v + b02 * w
        out[4, j] = e10 * x + e11 * y + e12 * z + b10 * u + b11 * v + b12 * w
        out[5, j] = e20 * x + e21 * y + e22 * z + b20 * u + b21 * v + b22 * w
        out[6, j], out[7, j], out[8, j] = P[6, j], P[7, j], P[8, j]
        out[9, j], out[10, j], out[11, j] = u, v, w
