"""Interaction matrices of image points and of their depths."""

import numpy as np
from numba import njit

from vergence.arrays import FloatArray

Row = tuple[float, float, float, float, float, float]


@njit(cache=True, error_model="numpy")
def interaction_matrix_points(points: FloatArray, depth: FloatArray) -> FloatArray:
    """Return the interaction matrix L of image points, (2M, 6): ṡ = L v_camera.

    Two rows a point:
    [-1/Z, 0, x/Z, xy, -(1 + x²), y] and [0, -1/Z, y/Z, 1 + y², -xy, -x].
    [Nelson1995] eq. (13) is this in pixels, its first entry printed with the wrong sign;
    [Mezouar2001] section 5.

    Args:
        points: normalized coordinates, (M, 2).
        depth: Z of each point along the optical axis, (M,), m.
    """
    L = np.empty((2 * len(points), 6))
    for j in range(len(points)):
        across, down = point_rows(points[j, 0], points[j, 1], depth[j])
        r = 2 * j
        L[r, 0], L[r, 1], L[r, 2], L[r, 3], L[r, 4], L[r, 5] = across
        r += 1
        L[r, 0], L[r, 1], L[r, 2], L[r, 3], L[r, 4], L[r, 5] = down
    return L


@njit(cache=True, error_model="numpy")
def point_rows(x: float, y: float, depth: float) -> tuple[Row, Row]:
    """Return the two rows of L of a point; as tuples they stay in registers."""
    near = 1.0 / depth
    return (
        (-near, 0.0, x * near, x * y, -(1.0 + x * x), y),
        (0.0, -near, y * near, 1.0 + y * y, -x * y, -x),
    )


def depth_interaction(points: FloatArray, depth: FloatArray) -> FloatArray:
    """Return the interaction matrix of points' depths, (M, 6): Ż = L v_camera.

    One row a point: [0, 0, -1, -yZ, xZ, 0] [Chaumette2006].

    Args:
        points: normalized coordinates, (M, 2).
        depth: Z of each point along the optical axis, (M,), m.
    """
    L = np.zeros((len(points), 6))
    L[:, 2] = -1.0
    L[:, 3], L[:, 4] = -points[:, 1] * depth, points[:, 0] * depth
    return L


def skew_matrices(vectors: FloatArray) -> FloatArray:
    """Return [u]×, with [u]× ω = u × ω, of vectors u (N, 3), (N, 3, 3)."""
    x, y, z = vectors.T
    zero = np.zeros(len(vectors))
    rows = np.array([[zero, -z, y], [z, zero, -x], [-y, x, zero]])
    return np.moveaxis(rows, 2, 0)
