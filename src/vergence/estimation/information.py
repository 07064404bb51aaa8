"""The update of a filter whose measurements depend on the first six of its twelve states.

Any number of whitened rows [H | r] is first compressed by orthogonal reflections to six, which
say the same about the pose (square-root information form): linear in the measurements. One
Joseph update follows, whose cost does not depend on them.
"""

import numpy as np
from numba import njit

from vergence.arrays import BoolArray, FloatArray
from vergence.estimation.measurement import POSE

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
    still, and |r|² = |z|² + rest, where rest is what no pose can explain.

    Args:
        rows: whitened, (n, 7), n >= 6, filled up with zeros; overwritten.
    """
    count = len(rows)
    dots = np.empty(POSE + 1)
    for k in range(POSE):
        norm = 0.0
        for i in range(k, count):
            norm += rows[i, k] * rows[i, k]
        if norm == 0.0:
            continue
        norm = np.sqrt(norm)
        if rows[k, k] > 0.0:
            norm = -norm
        head = rows[k, k] - norm  # the reflection is along (head, rows[k + 1:, k])
        for j in range(POSE + 1):
            dots[j] = head * rows[k, j]
        for i in range(k + 1, count):
            for j in range(POSE + 1):
                dots[j] += rows[i, k] * rows[i, j]
        scale = 1.0 / (norm * head)
        for j in range(k + 1, POSE + 1):
            rows[k, j] += head * scale * dots[j]
        for i in range(k + 1, count):
            along = scale * rows[i, k]
            for j in range(k + 1, POSE + 1):
                rows[i, j] += along * dots[j]
            rows[i, k] = 0.0
        rows[k, k] = norm
    rest = 0.0
    for i in range(POSE, count):
        rest += rows[i, POSE] * rows[i, POSE]
    return rest


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def joseph_update(P: FloatArray, reduced: FloatArray) -> tuple[FloatArray, FloatArray, float]:
    """Return the correction K z, the new covariance, and zᵀ S⁻¹ z.

    S = U P Uᵀ + I = L Lᵀ, K = P Uᵀ S⁻¹, P⁺ = (I - K U) P (I - K U)ᵀ + K Kᵀ.
    [Lippiello2005] eq. (12), (13), with the Joseph form in place of (12b).

    Args:
        P: covariance, (12, 12).
        reduced: whitened [U | z], (6, 7), U upper triangular, of states 0 to 5.
    """
    K = np.empty((STATES, POSE))  # first P Uᵀ
    for i in range(STATES):
        for m in range(POSE):
            K[i, m] = 0.0
            for k in range(m, POSE):
                K[i, m] += P[i, k] * reduced[m, k]
    L = _innovation_factor(K, reduced)
    correction, square = np.zeros(STATES), 0.0
    for i in range(POSE):
        z = reduced[i, POSE]
        for k in range(i):
            z -= L[i, k] * L[k, POSE]
        L[i, POSE] = z * L[i, i]  # L⁻¹ z
        square += L[i, POSE] * L[i, POSE]
    for i in range(STATES):
        _solve_factored(L, K[i])
        for m in range(POSE):
            correction[i] += K[i, m] * reduced[m, POSE]
    return correction, _joseph_covariance(P, K, reduced), square


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def _innovation_factor(PU: FloatArray, reduced: FloatArray) -> FloatArray:
    """Return L of S = U P Uᵀ + I, (6, 7): 1/L_ii on the diagonal, the last column free."""
    L = np.empty((POSE, POSE + 1))
    for i in range(POSE):
        for j in range(i + 1):
            s = 1.0 if i == j else 0.0
            for k in range(i, POSE):
                s += reduced[i, k] * PU[k, j]
            for k in range(j):
                s -= L[i, k] * L[j, k]
            L[i, j] = 1.0 / np.sqrt(s) if i == j else s * L[j, j]
    return L


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def _solve_factored(L: FloatArray, row: FloatArray) -> None:
    """Overwrite a row (6,) by (L Lᵀ)⁻¹ times it; the diagonal of L holds its inverse."""
    for i in range(POSE):
        value = row[i]
        for k in range(i):
            value -= L[i, k] * row[k]
        row[i] = value * L[i, i]
    for i in range(POSE - 1, -1, -1):
        value = row[i]
        for k in range(i + 1, POSE):
            value -= L[k, i] * row[k]
        row[i] = value * L[i, i]


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def _joseph_covariance(P: FloatArray, K: FloatArray, reduced: FloatArray) -> FloatArray:
    """Return (I - K U) P (I - K U)ᵀ + K Kᵀ: one triangle, and its mirror image.

    The sums over six are written out: they then run in registers, at half the time.
    """
    KU = np.zeros((STATES, POSE))
    for i in range(STATES):
        for k in range(POSE):
            for m in range(k + 1):
                KU[i, k] += K[i, m] * reduced[m, k]
    x = np.empty(STATES)  # a row of (I - K U) P
    updated = np.empty((STATES, STATES))
    for i in range(STATES):
        a0, a1, a2, a3, a4, a5 = KU[i, 0], KU[i, 1], KU[i, 2], KU[i, 3], KU[i, 4], KU[i, 5]
        k0, k1, k2, k3, k4, k5 = K[i, 0], K[i, 1], K[i, 2], K[i, 3], K[i, 4], K[i, 5]
        for j in range(STATES):
            x[j] = P[i, j] - (
                a0 * P[0, j]
                + a1 * P[1, j]
                + a2 * P[2, j]
                + a3 * P[3, j]
                + a4 * P[4, j]
                + a5 * P[5, j]
            )
        x0, x1, x2, x3, x4, x5 = x[0], x[1], x[2], x[3], x[4], x[5]
        for j in range(i + 1):
            c, d = KU[j], K[j]
            left = x0 * c[0] + x1 * c[1] + x2 * c[2] + x3 * c[3] + x4 * c[4] + x5 * c[5]
            added = k0 * d[0] + k1 * d[1] + k2 * d[2] + k3 * d[3] + k4 * d[4] + k5 * d[5]
            updated[i, j] = updated[j, i] = x[j] - left + added
    return updated
