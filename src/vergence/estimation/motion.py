"""The motion model: constant velocity of the target's origin and constant angular velocity.

    p' = p + v dt,  R' = exp(ω dt) R,  v' = v,  ω' = ω,

driven by white acceleration, so that the model holds for any step and two half steps are one.
"""

import numpy as np
from numba import njit

from vergence.arrays import FloatArray
from vergence.estimation.information import symmetrize
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


@njit(cache=True)
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
    J = so3_left_jacobian(velocity[3:] * dt)
    FP = P.copy()
    for j in range(12):
        for i in range(3):
            FP[i, j] += dt * P[6 + i, j]
    for i in range(3):
        for j in range(12):
            FP[3 + i, j] = 0.0
        for k in range(3):
            for j in range(12):
                FP[3 + i, j] += E[i, k] * P[3 + k, j] + dt * J[i, k] * P[9 + k, j]
    predicted = FP.copy()
    for i in range(12):
        for j in range(3):
            predicted[i, j] += dt * FP[i, 6 + j]
            value = 0.0
            for k in range(3):
                value += E[j, k] * FP[i, 3 + k] + dt * J[j, k] * FP[i, 9 + k]
            predicted[i, 3 + j] = value
    for i in range(6):
        d = density[i // 3]
        predicted[i, i] += d * dt * dt * dt / 3.0
        predicted[i, 6 + i] += d * dt * dt / 2.0
        predicted[6 + i, i] += d * dt * dt / 2.0
        predicted[6 + i, 6 + i] += d * dt
    return symmetrize(predicted)


@njit(cache=True)
def correct_pose(T_world_target: FloatArray, correction: FloatArray) -> FloatArray:
    """Return the pose moved by an error (δp, δθ): p + δp, exp(δθ) R."""
    return predict_pose(T_world_target, correction[:6], 1.0)
