"""Roll, pitch and yaw in the convention of [Lippiello2005]: R = Rz(φ) Ry(ϑ) Rx(ψ)."""

import numpy as np
from numba import njit

from vergence.arrays import FloatArray


@njit(cache=True)
def rpy_to_matrix(rpy: FloatArray) -> FloatArray:
    """Return R = Rz(φ) Ry(ϑ) Rx(ψ), (3, 3).

    [Lippiello2005] section III; the matrix is garbled in the text and is derived here.

    Args:
        rpy: (φ, ϑ, ψ), rad.
    """
    cos_phi, sin_phi = np.cos(rpy[0]), np.sin(rpy[0])
    cos_theta, sin_theta = np.cos(rpy[1]), np.sin(rpy[1])
    cos_psi, sin_psi = np.cos(rpy[2]), np.sin(rpy[2])
    R = np.empty((3, 3))
    R[0, 0] = cos_phi * cos_theta
    R[0, 1] = cos_phi * sin_theta * sin_psi - sin_phi * cos_psi
    R[0, 2] = cos_phi * sin_theta * cos_psi + sin_phi * sin_psi
    R[1, 0] = sin_phi * cos_theta
    R[1, 1] = sin_phi * sin_theta * sin_psi + cos_phi * cos_psi
    R[1, 2] = sin_phi * sin_theta * cos_psi - cos_phi * sin_psi
    R[2, 0] = -sin_theta
    R[2, 1] = cos_theta * sin_psi
    R[2, 2] = cos_theta * cos_psi
    return R


@njit(cache=True)
def matrix_to_rpy(R: FloatArray) -> FloatArray:
    """Return (φ, ϑ, ψ) of a rotation matrix, |ϑ| <= π/2.

    At ϑ = ±π/2 only φ ∓ ψ is determined; ψ = 0 is chosen there.
    """
    rpy = np.empty(3)
    cos_theta = np.sqrt(R[0, 0] * R[0, 0] + R[1, 0] * R[1, 0])
    rpy[1] = np.arctan2(-R[2, 0], cos_theta)
    if cos_theta < 1e-12:
        rpy[0], rpy[2] = np.arctan2(-R[0, 1], R[1, 1]), 0.0
    else:
        rpy[0], rpy[2] = np.arctan2(R[1, 0], R[0, 0]), np.arctan2(R[2, 1], R[2, 2])
    return rpy


@njit(cache=True)
def rpy_rates_to_omega(rpy: FloatArray) -> FloatArray:
    """Return T_o, (3, 3): ω = T_o d(φ, ϑ, ψ)/dt, along the axes of the reference frame.

    [Lippiello2005] eq. (17b), the matrix derived; det T_o = -cos ϑ, singular at ϑ = ±π/2.

    Args:
        rpy: (φ, ϑ, ψ), rad.
    """
    cos_phi, sin_phi = np.cos(rpy[0]), np.sin(rpy[0])
    cos_theta, sin_theta = np.cos(rpy[1]), np.sin(rpy[1])
    T = np.zeros((3, 3))
    T[0, 1], T[0, 2] = -sin_phi, cos_phi * cos_theta
    T[1, 1], T[1, 2] = cos_phi, sin_phi * cos_theta
    T[2, 0], T[2, 2] = 1.0, -sin_theta
    return T
