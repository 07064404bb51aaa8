"""Symmetric positive definite matrices of six axes: inverse and determinant in one sweep.

Loops of constant length six, one division a pivot: a third of what a call of LAPACK takes.
"""

import numpy as np
from numba import njit

from vergence.arrays import FloatArray

_PIVOT_FLOOR = 1e-15  # of the trace


@njit(cache=True, error_model="numpy")
def invert_spd(A: FloatArray) -> tuple[FloatArray, float]:
    """Return A⁻¹ (6, 6) and det A by Gauss and Jordan, which needs no pivoting here.

    A pivot at rounding level is lifted to it, so that the inverse of a singular A is large but
    finite; det A is then the product of the pivots as they were, at least 0.
    """
    inverse = A.copy()
    trace = 1e-280
    for i in range(6):
        trace += A[i, i]
    determinant = 1.0
    for k in range(6):
        determinant *= max(inverse[k, k], 0.0)
        scale = 1.0 / max(inverse[k, k], _PIVOT_FLOOR * trace)
        for j in range(6):
            inverse[k, j] *= scale
        inverse[k, k] = scale
        for i in range(6):
            if i != k:
                factor = inverse[i, k]
                inverse[i, k] = 0.0
                for j in range(6):
                    inverse[i, j] -= factor * inverse[k, j]
    return inverse, determinant


@njit(cache=True, error_model="numpy")
def outer_square(J: FloatArray) -> FloatArray:
    """Return J Jᵀ (6, 6) of J (6, n)."""
    A = np.empty((6, 6))
    for i in range(6):
        for j in range(i + 1):
            total = 0.0
            for k in range(J.shape[1]):
                total += J[i, k] * J[j, k]
            A[i, j], A[j, i] = total, total
    return A


@njit(cache=True, error_model="numpy")
def times_six(A: FloatArray, b: FloatArray) -> FloatArray:
    """Return A b (6,)."""
    product = np.empty(6)
    for i in range(6):
        total = 0.0
        for j in range(6):
            total += A[i, j] * b[j]
        product[i] = total
    return product
