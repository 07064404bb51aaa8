"""Linear initial estimates: the homography of a plane, and the essential matrix by three points."""

import numpy as np
from numba import njit

from vergence.arrays import FloatArray, IntArray
from vergence.vision.two_view.small import (
    apply,
    cholesky_inverse,
    dot,
    inverse3,
    symmetric_eigen,
    times,
    transposed_times,
    unit,
)

_MOST_STEPS = 100
_ROUNDING = 1e-15


@njit(cache=True)
def conditioner(points: FloatArray) -> FloatArray:
    """Return the similarity that centres points (N, 2) and scales them to a mean norm of √2."""
    count = len(points)
    x, y = points[:, 0].mean(), points[:, 1].mean()
    spread = 0.0
    for j in range(count):
        spread += np.hypot(points[j, 0] - x, points[j, 1] - y)
    scale = np.sqrt(2.0) * count / max(spread, 1e-300)
    return np.array([[scale, 0.0, -scale * x], [0.0, scale, -scale * y], [0.0, 0.0, 1.0]])


@njit(cache=True)
def homogeneous(points: FloatArray) -> FloatArray:
    """Append a one to points (N, 2)."""
    result = np.ones((len(points), 3))
    result[:, :2] = points
    return result


@njit(cache=True)
def smallest_direction(A: FloatArray) -> FloatArray:
    """Return the unit vector x with the smallest ‖A x‖.

    By inverse iteration, from the best unit vector: if the next smallest singular value is much
    larger, as for points that determine the solution, a few steps reach rounding level.
    """
    inverse = cholesky_inverse(_lifted(transposed_times(A, A)))
    best = 0
    for i in range(len(inverse)):
        if inverse[i, i] > inverse[best, best]:
            best = i
    x = unit(inverse[best])
    for _ in range(_MOST_STEPS):
        following = unit(apply(inverse, x))
        turned = dot(following - x, following - x)
        x = following
        if turned < _ROUNDING**2:
            break
    return x


@njit(cache=True)
def _lifted(S: FloatArray) -> FloatArray:
    """Add to the diagonal of a symmetric S so that it is positive definite beyond rounding."""
    lift = _ROUNDING * np.trace(S) + 1e-300
    for i in range(len(S)):
        S[i, i] += lift
    return S


@njit(cache=True)
def linear_homography(m_star: FloatArray, m: FloatArray) -> FloatArray:
    """Solve m × (H m*) = 0 for H, (3, 3), from four or more points of a plane.

    H has middle singular value 1, and the sign for which the points are in front of both cameras:
    Σ m·H m* > 0. [Mezouar2001] eq. (2) with β = 0, in normalized coordinates.

    Args:
        m_star: points in the desired view, normalized, (N, 2).
        m: the same points in the current view, (N, 2).
    """
    to_star, to = conditioner(m_star), conditioner(m)
    a, b = times(homogeneous(m_star), to_star.T), times(homogeneous(m), to.T)
    rows = np.zeros((2 * len(a), 9))
    for j in range(len(a)):
        rows[2 * j, 0:3] = a[j]
        rows[2 * j, 6:9] = -b[j, 0] * a[j]
        rows[2 * j + 1, 3:6] = a[j]
        rows[2 * j + 1, 6:9] = -b[j, 1] * a[j]
    H = times(inverse3(to), times(smallest_direction(rows).reshape(3, 3), to_star))
    front = np.sum(times(homogeneous(m_star), H.T) * homogeneous(m))
    middle = np.sqrt(max(symmetric_eigen(transposed_times(H, H))[0][1], 1e-300))
    sign = 1.0 if front >= 0.0 else -1.0
    scaled: FloatArray = H * (sign / middle)
    return scaled


@njit(cache=True)
def linear_essential(m_star: FloatArray, m: FloatArray, triple: IntArray) -> FloatArray:
    """Solve mᵀ E m* = 0 for E, (3, 3), from eight or more points, three of them the reference.

    In the basis of the three reference points the matrix has a zero diagonal and six unknowns
    ([Mezouar2001] section 3.1 after Malis and Chaumette; with three marks on each of three planes
    no plane has four points, and this is the only linear method).

    Args:
        m_star: points in the desired view, normalized, (N, 2).
        m: the same points in the current view, (N, 2).
        triple: indices of the reference points, not collinear in either view, (3,).
    """
    a, b = homogeneous(m_star), homogeneous(m)
    basis_star, basis = np.empty((3, 3)), np.empty((3, 3))
    for k in range(3):
        basis_star[:, k] = a[triple[k]]
        basis[:, k] = b[triple[k]]
    inverse_star, inverse = inverse3(basis_star), inverse3(basis)
    a, b = times(a, inverse_star.T), times(b, inverse.T)
    rows = np.empty((len(a), 6))
    for j in range(len(a)):
        weight = 1.0 / np.sqrt(dot(a[j], a[j]) * dot(b[j], b[j]))
        column = 0
        for r in range(3):
            for c in range(3):
                if r != c:
                    rows[j, column] = weight * b[j, r] * a[j, c]
                    column += 1
    f = smallest_direction(rows)
    F = np.array([[0.0, f[0], f[1]], [f[2], 0.0, f[3]], [f[4], f[5], 0.0]])
    return times(transposed_times(inverse, F), inverse_star)
