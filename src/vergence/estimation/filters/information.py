"""The update of a filter whose measurements depend on the first six of its twelve states.

Any number of whitened rows [H | r] is first compressed by orthogonal reflections to six, which
say the same about the pose (square-root information form): linear in the measurements. One
Joseph update follows, whose cost does not depend on them.
"""

import numpy as np
from numba import njit

from vergence.arrays import BoolArray, FloatArray
from vergence.estimation.filters.measurement import POSE
from vergence.kernels.scratch import scratch

STATES = 12


@njit(cache=True)
def keep_rows(rows: FloatArray, kept: BoolArray) -> FloatArray:
    """Return the rows of the points that are kept, as a new array of at least six rows."""
    count = 0
    for n in range(len(kept)):
        count += kept[n]
    packed = np.zeros((max(2 * count, POSE), rows.shape[1]))
    count = 0
    for n in range(len(kept)):
        if kept[n]:
            packed[2 * count] = rows[2 * n]
            packed[2 * count + 1] = rows[2 * n + 1]
            count += 1
    return packed


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def compress(rows: FloatArray) -> float:
    """Reflect [H | r] to [U | z] in its first six rows, U upper triangular; return the rest.

    Since the reflections (Householder's) are orthogonal, the noise of the new rows is the identity
    still, and |r|² = |z|² + rest, where rest is what no pose can explain. The sums over columns
    are written out: they then run side by side in registers.

    Args:
        rows: whitened, (n, 7), n >= 6, filled up with zeros; overwritten.
    """
    count = len(rows)
    for k in range(POSE):
        top, square = rows[k, k], 0.0
        d1, d2, d3, d4, d5, d6 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for i in range(k + 1, count):
            r, a = rows[i], rows[i, k]
            square += a * a
            d1, d2, d3 = d1 + a * r[1], d2 + a * r[2], d3 + a * r[3]
            d4, d5, d6 = d4 + a * r[4], d5 + a * r[5], d6 + a * r[6]
        norm = np.sqrt(square + top * top)
        if norm == 0.0:
            continue
        if top > 0.0:
            norm = -norm
        head = top - norm  # the reflection is along (head, rows[k + 1:, k])
        scale, r = 1.0 / (norm * head), rows[k]
        d1 = scale * (d1 + head * r[1]) if k < 1 else 0.0  # columns up to k are done
        d2 = scale * (d2 + head * r[2]) if k < 2 else 0.0
        d3 = scale * (d3 + head * r[3]) if k < 3 else 0.0
        d4 = scale * (d4 + head * r[4]) if k < 4 else 0.0
        d5 = scale * (d5 + head * r[5]) if k < 5 else 0.0
        d6 = scale * (d6 + head * r[6])
        for i in range(k, count):
            r, a = rows[i], head if i == k else rows[i, k]
            r[1], r[2], r[3] = r[1] + a * d1, r[2] + a * d2, r[3] + a * d3
            r[4], r[5], r[6] = r[4] + a * d4, r[5] + a * d5, r[6] + a * d6
            r[k] = 0.0
        rows[k, k] = norm
    rest = 0.0
    for i in range(POSE, count):
        rest += rows[i, POSE] * rows[i, POSE]
    return rest


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def joseph_update(P: FloatArray, reduced: FloatArray) -> tuple[FloatArray, FloatArray, float]:
    """Return the correction K z, the new covariance, and zᵀ S⁻¹ z.

    S = U P Uᵀ + I = L Lᵀ, K = P Uᵀ S⁻¹, P⁺ = (I - K U) P (I - K U)ᵀ + K Kᵀ, which is
    X + K (K - X Uᵀ)ᵀ with X = (I - K U) P.
    [Lippiello2005] eq. (12), (13), with the Joseph form in place of (12b).

    Args:
        P: covariance, (12, 12).
        reduced: whitened [U | z], (6, 7), U upper triangular, of states 0 to 5.
    """
    UP, Kt, X, Gt = scratch(6, 12), scratch(6, 12), scratch(12, 12), scratch(6, 12)
    inverse, zero = scratch(6, 6), scratch(6, 12)
    zero[:] = 0.0
    _add_product(UP, zero, 1.0, reduced, P)
    _innovation_inverse(UP, reduced, inverse)
    _add_product(Kt, zero, 1.0, inverse, UP)
    _add_product(X, P, -1.0, UP.T, Kt)  # its transpose, as all that follows
    _add_product(Gt, Kt, -1.0, reduced, X)
    _add_product(X, X, 1.0, Kt.T, Gt)
    correction, square = np.zeros(STATES), 0.0
    for m in range(POSE):
        z = reduced[m, POSE]
        for i in range(STATES):
            correction[i] += Kt[m, i] * z
        for k in range(POSE):
            square += z * inverse[m, k] * reduced[k, POSE]
    updated = np.empty((STATES, STATES))
    for i in range(STATES):
        for j in range(i + 1):
            updated[i, j] = updated[j, i] = X[j, i]
    return correction, updated, square


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def _add_product(out: FloatArray, C: FloatArray, sign: float, A: FloatArray, B: FloatArray) -> None:
    """Fill `out` (n, 12) with C + sign · A B, where A has six columns and n is even.

    Two rows at a time, their sums written out: the compiler then works on four columns at once.
    """
    for i in range(0, len(out), 2):
        a, b = A[i], A[i + 1]
        a0, a1, a2 = sign * a[0], sign * a[1], sign * a[2]
        a3, a4, a5 = sign * a[3], sign * a[4], sign * a[5]
        b0, b1, b2 = sign * b[0], sign * b[1], sign * b[2]
        b3, b4, b5 = sign * b[3], sign * b[4], sign * b[5]
        for j in range(STATES):
            x0, x1, x2, x3, x4, x5 = B[0, j], B[1, j], B[2, j], B[3, j], B[4, j], B[5, j]
            first = a0 * x0 + a1 * x1 + a2 * x2 + a3 * x3 + a4 * x4 + a5 * x5
            second = b0 * x0 + b1 * x1 + b2 * x2 + b3 * x3 + b4 * x4 + b5 * x5
            out[i, j], out[i + 1, j] = C[i, j] + first, C[i + 1, j] + second


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def _innovation_inverse(UP: FloatArray, reduced: FloatArray, inverse: FloatArray) -> None:
    """Fill `inverse` with S⁻¹ of S = U P Uᵀ + I, (6, 6), by its Cholesky factor.

    The eigenvalues of S are 1 or more, and the Joseph form forgives a gain that is slightly off.
    """
    L = scratch(6, 6)  # its lower half, the diagonal inverted; then L⁻¹
    for i in range(POSE):
        for j in range(i + 1):
            s = 1.0 if i == j else 0.0
            for k in range(i, POSE):
                s += reduced[i, k] * UP[j, k]
            for k in range(j):
                s -= L[i, k] * L[j, k]
            L[i, j] = 1.0 / np.sqrt(s) if i == j else s * L[j, j]
    for j in range(POSE):
        for i in range(j + 1, POSE):
            s = 0.0
            for k in range(j, i):
                s -= L[i, k] * L[k, j]
            L[i, j] = s * L[i, i]
    for i in range(POSE):
        for j in range(i + 1):
            s = 0.0
            for k in range(i, POSE):
                s += L[k, i] * L[k, j]
            inverse[i, j] = inverse[j, i] = s
