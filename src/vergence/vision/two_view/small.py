"""Products and inverses of matrices with a few rows, for which a BLAS call costs more than the sum.

They accept any memory layout, and compile in a fraction of the time.
"""

import numpy as np
from numba import njit

from vergence.arrays import FloatArray

_SWEEPS = 30  # of Jacobi's method; it takes about five


@njit(cache=True)
def times(A: FloatArray, B: FloatArray) -> FloatArray:
    """Return A B of two matrices."""
    C = np.zeros((A.shape[0], B.shape[1]))
    for i in range(A.shape[0]):
        for k in range(A.shape[1]):
            a = A[i, k]
            for j in range(B.shape[1]):
                C[i, j] += a * B[k, j]
    return C


@njit(cache=True)
def transposed_times(A: FloatArray, B: FloatArray) -> FloatArray:
    """Return Aᵀ B of two matrices."""
    C = np.zeros((A.shape[1], B.shape[1]))
    for k in range(A.shape[0]):
        for i in range(A.shape[1]):
            a = A[k, i]
            for j in range(B.shape[1]):
                C[i, j] += a * B[k, j]
    return C


@njit(cache=True)
def apply(A: FloatArray, x: FloatArray) -> FloatArray:
    """Return A x of a matrix and a vector."""
    y = np.zeros(A.shape[0])
    for i in range(A.shape[0]):
        for k in range(A.shape[1]):
            y[i] += A[i, k] * x[k]
    return y


@njit(cache=True)
def transposed_apply(A: FloatArray, x: FloatArray) -> FloatArray:
    """Return Aᵀ x of a matrix and a vector."""
    y = np.zeros(A.shape[1])
    for k in range(A.shape[0]):
        for i in range(A.shape[1]):
            y[i] += A[k, i] * x[k]
    return y


@njit(cache=True)
def dot(x: FloatArray, y: FloatArray) -> float:
    """Return x·y of two vectors."""
    total = 0.0
    for k in range(len(x)):
        total += x[k] * y[k]
    return total


@njit(cache=True)
def cross(x: FloatArray, y: FloatArray) -> FloatArray:
    """Return x × y of two vectors (3,)."""
    return np.array(
        [x[1] * y[2] - x[2] * y[1], x[2] * y[0] - x[0] * y[2], x[0] * y[1] - x[1] * y[0]]
    )


@njit(cache=True)
def inverse3(A: FloatArray) -> FloatArray:
    """Return A⁻¹ of A (3, 3) by its cofactors; infinite or NaN if A is singular."""
    B = np.empty((3, 3))
    for k in range(3):
        B[k] = cross(A[:, (k + 1) % 3], A[:, (k + 2) % 3])
    determinant = dot(B[0], A[:, 0])
    if determinant == 0.0:
        return np.full((3, 3), np.inf)
    return B / determinant


@njit(cache=True)
def unit(x: FloatArray) -> FloatArray:
    """Return x / ‖x‖."""
    length: float = np.sqrt(max(dot(x, x), 1e-300))
    return x / length


@njit(cache=True)
def symmetric_eigen(A: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the eigenvalues (n,), ascending, and eigenvectors (n, n), columns, of a symmetric A.

    By Jacobi rotations, which for three rows finish before LAPACK has started.
    """
    n = len(A)
    D, V = A.copy(), np.eye(n)
    for _ in range(_SWEEPS):
        off, size = 0.0, 0.0
        for i in range(n):
            size += D[i, i] ** 2
            for j in range(i):
                off += D[i, j] ** 2
        if off <= 1e-34 * size:
            break
        for i in range(n):
            for j in range(i):
                if D[i, j] != 0.0:
                    _rotate(D, V, i, j)
    order = np.argsort(np.diag(D))
    return np.diag(D)[order], V[:, order]


@njit(cache=True)
def _rotate(D: FloatArray, V: FloatArray, i: int, j: int) -> None:
    """Rotate rows and columns i and j of a symmetric D, in place, so that D[i, j] vanishes."""
    half = (D[j, j] - D[i, i]) / (2.0 * D[i, j])
    t = np.copysign(1.0, half) / (abs(half) + np.sqrt(half * half + 1.0))
    c = 1.0 / np.sqrt(t * t + 1.0)
    s = t * c
    for k in range(len(D)):
        D[k, i], D[k, j] = c * D[k, i] - s * D[k, j], s * D[k, i] + c * D[k, j]
        V[k, i], V[k, j] = c * V[k, i] - s * V[k, j], s * V[k, i] + c * V[k, j]
    for k in range(len(D)):
        D[i, k], D[j, k] = c * D[i, k] - s * D[j, k], s * D[i, k] + c * D[j, k]


@njit(cache=True)
def cholesky_solve(A: FloatArray, B: FloatArray) -> FloatArray:
    """Return A⁻¹ B for a symmetric positive definite A (n, n) and B (n, k).

    A pivot that rounding has made negative is taken as tiny, which makes the step along it huge
    and leaves the refusal to whoever judges the step.
    """
    n, columns = len(A), B.shape[1]
    L, X = np.zeros((n, n)), B.copy()
    for i in range(n):
        for j in range(i + 1):
            total = A[i, j]
            for k in range(j):
                total -= L[i, k] * L[j, k]
            L[i, j] = np.sqrt(max(total, 1e-300)) if i == j else total / L[j, j]
    for c in range(columns):
        for i in range(n):
            for k in range(i):
                X[i, c] -= L[i, k] * X[k, c]
            X[i, c] /= L[i, i]
        for i in range(n - 1, -1, -1):
            for k in range(i + 1, n):
                X[i, c] -= L[k, i] * X[k, c]
            X[i, c] /= L[i, i]
    return X


@njit(cache=True)
def cholesky_inverse(A: FloatArray) -> FloatArray:
    """Return A⁻¹ of a symmetric positive definite A."""
    return cholesky_solve(A, np.eye(len(A)))
