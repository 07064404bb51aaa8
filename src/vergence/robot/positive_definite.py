"""Symmetric positive definite matrices: inverse and determinant in one sweep.

For the six axes of a twist loops of constant length six, one division a pivot: a third of what a
call of LAPACK takes.
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
def invert_spd_any(A: FloatArray) -> tuple[FloatArray, float]:
    """Return A⁻¹ (n, n) and det A for as many joints as there are, as `invert_spd` does."""
    n = len(A)
    if n == 6:
        return invert_spd(A)
    inverse = A.copy()
    trace = 1e-280
    for i in range(n):
        trace += A[i, i]
    determinant = 1.0
    for k in range(n):
        determinant *= max(inverse[k, k], 0.0)
        scale = 1.0 / max(inverse[k, k], _PIVOT_FLOOR * trace)
        for j in range(n):
            inverse[k, j] *= scale
        inverse[k, k] = scale
        for i in range(n):
            if i != k:
                factor = inverse[i, k]
                inverse[i, k] = 0.0
                for j in range(n):
                    inverse[i, j] -= factor * inverse[k, j]
    return inverse, determinant


@njit(cache=True, error_model="numpy")
def factor_spd(A: FloatArray) -> None:
    """Turn A (6, 6) into its factors in place, A = L D Lᵀ: L below the diagonal, D⁻¹ on it."""
    for k in range(6):
        A[k, k] = 1.0 / A[k, k]
        for i in range(k + 1, 6):
            factor = A[i, k] * A[k, k]
            for j in range(k + 1, i + 1):
                A[i, j] -= factor * A[j, k]
        for i in range(k + 1, 6):
            A[i, k] *= A[k, k]


@njit(cache=True, error_model="numpy")
def solve_factored(L: FloatArray, b: FloatArray) -> None:
    """Replace b (6,) by A⁻¹ b, given what `factor_spd` made of A."""
    for i in range(1, 6):
        for j in range(i):
            b[i] -= L[i, j] * b[j]
    for i in range(6):
        b[i] *= L[i, i]
    for i in range(4, -1, -1):
        for j in range(i + 1, 6):
            b[i] -= L[j, i] * b[j]


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
