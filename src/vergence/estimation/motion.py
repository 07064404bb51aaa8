"""The motion model: constant velocity of the target's origin and constant angular velocity.

    p' = p + v dt,  R' = exp(ω dt) R,  v' = v,  ω' = ω,

driven by white acceleration, so that the model holds for any step and two half steps are one.
"""

import numpy as np
from numba import njit

from vergence.arrays import FloatArray
from vergence.geometry import so3_exp, so3_left_jacobian


@njit(cache=True)
def predict_pose(T_world_target: FloatArray, velocity: FloatArray, dt: float) -> FloatArray:
    """Return the pose (4, 4) after dt seconds of constant velocity (v, ω), world axes."""
    E = so3_exp(velocity[3:] * dt)
    T = np.zeros((4, 4))
    for i in range(3):
        for j in range(3):
            for k in range(3):
                T[i, j] += E[i, k] * T_world_target[k, j]
        T[i, 3] = T_world_target[i, 3] + velocity[i] * dt
    T[3, 3] = 1.0
    return T


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
    E = so3_exp(velocity[3:] * dt)
    B = so3_left_jacobian(velocity[3:] * dt)
    FP = P.copy()
    for i in range(3):
        e0, e1, e2 = E[i, 0], E[i, 1], E[i, 2]
        b0, b1, b2 = dt * B[i, 0], dt * B[i, 1], dt * B[i, 2]
        for j in range(12):
            FP[i, j] += dt * P[6 + i, j]
            FP[3 + i, j] = (
                e0 * P[3, j]
                + e1 * P[4, j]
                + e2 * P[5, j]
                + b0 * P[9, j]
                + b1 * P[10, j]
                + b2 * P[11, j]
            )
    predicted = FP.copy()  # times Fᵀ: the columns as the rows before, one triangle of them
    for i in range(12):
        row = FP[i]
        for j in range(min(i + 1, 3)):
            predicted[i, j] += dt * row[6 + j]
            predicted[j, i] = predicted[i, j]
        for j in range(min(i - 2, 3)):
            rotation = E[j, 0] * row[3] + E[j, 1] * row[4] + E[j, 2] * row[5]
            rate = B[j, 0] * row[9] + B[j, 1] * row[10] + B[j, 2] * row[11]
            predicted[i, 3 + j] = predicted[3 + j, i] = rotation + dt * rate
    for i in range(6):
        d = density[i // 3]
        predicted[i, i] += d * dt * dt * dt / 3.0
        predicted[i, 6 + i] += d * dt * dt / 2.0
        predicted[6 + i, i] = predicted[i, 6 + i]
        predicted[6 + i, 6 + i] += d * dt
    return predicted


@njit(cache=True)
def correct_pose(T_world_target: FloatArray, correction: FloatArray) -> FloatArray:
    """Return the pose moved by an error (δp, δθ): p + δp, exp(δθ) R."""
    return predict_pose(T_world_target, correction[:6], 1.0)
