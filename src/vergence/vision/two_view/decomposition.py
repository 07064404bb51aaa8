"""The camera motion from a homography or an essential matrix.

Every motion here is (R, t) with X = R X* + t: the pose of the desired camera in the current one.
The paper's *R_c and *t_c are its inverse.
"""

import numpy as np
from numba import njit

from vergence.arrays import FloatArray
from vergence.vision.two_view.small import (
    apply,
    cross,
    dot,
    symmetric_eigen,
    times,
    transposed_times,
    unit,
)


@njit(cache=True)
def decompose_homography(H: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the two motions and planes behind H = R + t nᵀ, the plane in front of n·m* > 0.

    Of the four algebraic solutions two are mirror images (−t, −n); the caller's H has its middle
    singular value at 1. [Faugeras and Lustman 1988], in the form of the eigenvectors of HᵀH.

    Returns:
        R (2, 3, 3), t over the distance of the plane (2, 3), unit normal with n_z ≥ 0 (2, 3).
    """
    values, V = symmetric_eigen(transposed_times(H, H))
    low, high = min(values[0], 1.0), max(values[2], 1.0)
    gap = high - low
    share = (1.0 - low) / gap if gap > 0.0 else 1.0
    v1, v2, v3 = V[:, 2].copy(), V[:, 1].copy(), V[:, 0].copy()
    rotations, translations, normals = np.empty((2, 3, 3)), np.empty((2, 3)), np.empty((2, 3))
    for k in range(2):
        sign = 1.0 - 2.0 * k
        u = np.sqrt(share) * v1 + sign * np.sqrt(1.0 - share) * v3
        normal = cross(v2, u)
        U, W = np.empty((3, 3)), np.empty((3, 3))
        U[:, 0], U[:, 1], U[:, 2] = v2, u, normal
        W[:, 0], W[:, 1] = unit(apply(H, v2)), unit(apply(H, u))  # these are orthogonal
        W[:, 2] = cross(W[:, 0], W[:, 1])
        R = times(W, U.T)
        if normal[2] < 0.0:
            normal = -normal
        rotations[k], normals[k] = R, normal
        translations[k] = apply(H - R, normal)
    return rotations, translations, normals


@njit(cache=True)
def decompose_essential(E: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the four motions behind E = [t]× R: R (4, 3, 3) and unit t (4, 3)."""
    U, _, Vt = np.linalg.svd(E)
    if np.linalg.det(U) < 0.0:
        U = -U
    if np.linalg.det(Vt) < 0.0:
        Vt = -Vt
    W = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    W_transposed = W.T.copy()
    rotations, translations = np.empty((4, 3, 3)), np.empty((4, 3))
    for k in range(4):
        rotations[k] = times(times(U, W if k < 2 else W_transposed), Vt)
        translations[k] = U[:, 2] if k % 2 == 0 else -U[:, 2]
    return rotations, translations


@njit(cache=True)
def inverse_depths(
    R: FloatArray, t: FloatArray, m_star: FloatArray, m: FloatArray
) -> tuple[FloatArray, int]:
    """Return 1/Z* of each point, (N,), in units of 1/‖t‖, and how many are in front of both.

    From Z m = Z* R m* + t: the cross product with m gives (R m*) × m + w t × m = 0 for w = 1/Z*,
    the same least squares as [Mezouar2001] eq. (10) without its unknown μ.
    """
    w = np.empty(len(m))
    front = 0
    for j in range(len(m)):
        ray = np.array([m[j, 0], m[j, 1], 1.0])
        turned = apply(R, np.array([m_star[j, 0], m_star[j, 1], 1.0]))
        along, offset = cross(turned, ray), cross(t, ray)
        w[j] = -dot(along, offset) / max(dot(offset, offset), 1e-300)
        if w[j] > 0.0 and turned[2] + w[j] * t[2] > 0.0:
            front += 1
    return w, front
