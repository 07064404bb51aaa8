"""2 × 2 matrices in kernels."""

import numpy as np
from numba import njit

from vergence.arrays import FloatArray


@njit(cache=True, inline="always")
def inverse2(A: FloatArray) -> FloatArray:
    """Inverse of a 2 × 2 matrix."""
    determinant = A[0, 0] * A[1, 1] - A[0, 1] * A[1, 0]
    out = np.empty((2, 2))
    out[0, 0], out[0, 1] = A[1, 1] / determinant, -A[0, 1] / determinant
    out[1, 0], out[1, 1] = -A[1, 0] / determinant, A[0, 0] / determinant
    return out


@njit(cache=True, inline="always")
def product2(A: FloatArray, B: FloatArray) -> FloatArray:
    """A B for 2 × 2 matrices."""
    out = np.empty((2, 2))
    for i in range(2):
        for j in range(2):
            out[i, j] = A[i, 0] * B[0, j] + A[i, 1] * B[1, j]
    return out


@njit(cache=True, inline="always")
def apply2(A: FloatArray, x: FloatArray) -> FloatArray:
    """A x for a 2 × 2 matrix."""
    out = np.empty(2)
    out[0], out[1] = A[0, 0] * x[0] + A[0, 1] * x[1], A[1, 0] * x[0] + A[1, 1] * x[1]
    return out


@njit(cache=True, inline="always")
def stretch(A: FloatArray) -> float:
    """The larger of σ₁ and 1/σ₂ of a 2 × 2 matrix: 1 for a rotation."""
    total = 0.5 * (A[0, 0] ** 2 + A[0, 1] ** 2 + A[1, 0] ** 2 + A[1, 1] ** 2)
    determinant = abs(A[0, 0] * A[1, 1] - A[0, 1] * A[1, 0])
    root = np.sqrt(max(total * total - determinant * determinant, 0.0))
    largest = np.sqrt(total + root)
    return float(max(largest, largest / max(determinant, 1e-12)))
