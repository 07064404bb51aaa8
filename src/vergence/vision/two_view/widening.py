"""Covariances that contain what the matches allow where their error is no quadratic.

The covariance at a minimum takes the motion to be linear in the measurements. A turn and a motion
aside look alike, so the error has valleys, which bend; and the motions behind a homography branch.
So other motions are held against the covariance: one that costs χ² = c more than the best is to
lie within √c deviations. Where it lies farther out, the covariance grows along the difference d,
C ← C + (1/c − 1/dᵀC⁻¹d) d dᵀ, after which dᵀC⁻¹d = c. Where the error is a quadratic, nothing
changes.
"""

import numpy as np
from numba import njit

from vergence.arrays import FloatArray
from vergence.geometry import so3_exp, so3_left_jacobian_inverse, so3_log
from vergence.vision.two_view.decomposition import decompose_homography
from vergence.vision.two_view.linear import homogeneous
from vergence.vision.two_view.small import apply, cholesky_solve, dot, symmetric_eigen, times

SLACK = 1.5  # of dᵀC⁻¹d over χ²: what the covariance at the minimum may miss
_LEAST = 1.0  # χ² below which a motion counts as that far
DRAWS = 2.0 * np.random.default_rng(0).normal(size=(512, 8))  # out to where few motions lie


@njit(cache=True)
def upsilon_between(upsilon: FloatArray, R: FloatArray, t_d: FloatArray) -> FloatArray:
    """Return (t_d, uθ) of a motion, less Υ, (6,).

    Args:
        upsilon: Υ = (t_d, uθ), (6,).
        R: of the other motion, *R_c, (3, 3).
        t_d: of the other motion, (3,).
    """
    angles = upsilon[3:].copy()
    J = so3_left_jacobian_inverse(angles)
    difference = np.empty(6)
    difference[:3] = t_d - upsilon[:3]
    difference[3:] = apply(J, so3_log(times(R, so3_exp(angles).T)))
    return difference


@njit(cache=True)
def widen(covariances: FloatArray, differences: FloatArray, level: float) -> None:
    """Let the motion to which another is nearest contain it, in place.

    Args:
        covariances: of each motion, (K, 6, 6).
        differences: of the other motion from each, (K, 6).
        level: largest dᵀC⁻¹d of the other's difference d.
    """
    nearest, least = 0, np.inf
    for k in range(len(covariances)):
        weighed = cholesky_solve(covariances[k], differences[k].copy().reshape(6, 1))[:, 0]
        square = dot(differences[k], weighed)
        if square < least:
            nearest, least = k, square
    if level < least < np.inf:
        growth = 1.0 / level - 1.0 / least
        d = differences[nearest]
        for i in range(6):
            for j in range(6):
                covariances[nearest, i, j] += growth * d[i] * d[j]


@njit(cache=True)
def homography_information(
    H: FloatArray, m_star: FloatArray, m: FloatArray, variance: float
) -> FloatArray:
    """Return the information on the entries of H, row by row, (9, 9); its null space is H.

    Of the transfer error e = π(H m*) − m, with variance (I + J Jᵀ) times that of a coordinate,
    J = ∂π(H m*)/∂m*.
    """
    total = np.zeros((9, 9))
    rows = np.zeros((2, 9))
    for j in range(len(m)):
        ray = np.array([m_star[j, 0], m_star[j, 1], 1.0])
        X = apply(H, ray)
        J = np.empty((2, 2))
        for i in range(2):
            p = X[i] / X[2]
            for k in range(3):
                rows[i, 3 * i + k] = ray[k] / X[2]
                rows[i, 6 + k] = -p * ray[k] / X[2]
            for k in range(2):
                J[i, k] = (H[i, k] - p * H[2, k]) / X[2]
        S = variance * (np.eye(2) + times(J, J.T))
        total += times(rows.T, cholesky_solve(S, rows))
    return total


@njit(cache=True)
def widen_for_plane(
    covariances: FloatArray,
    upsilons: FloatArray,
    H: FloatArray,
    m_star: FloatArray,
    m: FloatArray,
    variance: float,
    draws: FloatArray,
) -> None:
    """Let the motions behind a homography contain those behind all likely ones, in place.

    The error is a quadratic in H, but not in its motions: where the two are near each other, they
    turn by much for a little noise.

    Args:
        covariances: of each motion, (K, 6, 6).
        upsilons: the motions, (K, 6).
        H: homography with middle singular value 1, (3, 3).
        m_star: points in the desired view, normalized, (N, 2).
        m: the same points in the current view, (N, 2).
        variance: of a normalized coordinate.
        draws: of standard normal numbers, (S, 8).
    """
    values, vectors = symmetric_eigen(homography_information(H, m_star, m, variance))
    rays = homogeneous(m_star)
    differences = np.empty((len(upsilons), 6))
    for draw in draws:
        other, chi_square = H.copy(), dot(draw, draw)
        for k in range(8):
            step = draw[k] / np.sqrt(max(values[k + 1], 1e-12))
            other += step * vectors[:, k + 1].copy().reshape(3, 3)
        middle = np.sqrt(max(symmetric_eigen(times(other.T, other))[0][1], 1e-300))
        rotations, translations, normals = decompose_homography(other / middle)
        for k in range(2):
            if not seen_by_both(rotations[k], translations[k], normals[k], rays):
                continue
            Rt = rotations[k].T.copy()
            for a in range(len(upsilons)):
                differences[a] = upsilon_between(upsilons[a], Rt, -apply(Rt, translations[k]))
            widen(covariances, differences, SLACK * max(chi_square, _LEAST))


@njit(cache=True)
def seen_by_both(R: FloatArray, t: FloatArray, n: FloatArray, rays: FloatArray) -> bool:
    """Return whether the points of a plane lie before both cameras, on the side that both see."""
    for j in range(len(rays)):
        inverse_rho_star = dot(rays[j], n)
        if inverse_rho_star <= 0.0 or dot(R[2], rays[j]) + inverse_rho_star * t[2] <= 0.0:
            return False
    return dot(t, apply(R, n)) > -1.0
