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
def _mix(c: FloatArray, A: FloatArray, j: int) -> float:
    """Return Σ c_k A_kj over six rows, written out so that loops over j run in vector registers."""
    total: float = (
        c[0] * A[0, j]
        + c[1] * A[1, j]
        + c[2] * A[2, j]
        + c[3] * A[3, j]
        + c[4] * A[4, j]
        + c[5] * A[5, j]
    )
    return total


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def joseph_update(P: FloatArray, reduced: FloatArray) -> tuple[FloatArray, FloatArray, float]:
    """Return the correction K z, the new covariance, and zᵀ S⁻¹ z.

    S = U P Uᵀ + I, K = P Uᵀ S⁻¹, P⁺ = (I - K U) P (I - K U)ᵀ + K Kᵀ.
    [Lippiello2005] eq. (12), (13), with the Joseph form in place of (12b).

    Args:
        P: covariance, (12, 12).
        reduced: whitened [U | z], (6, 7), U upper triangular, of states 0 to 5.
    """
    gain = np.empty((POSE, STATES))  # U P, becomes L⁻¹ U P, then Kᵀ = S⁻¹ U P
    for i in range(POSE):
        for j in range(STATES):
            gain[i, j] = _mix(reduced[i], P, j)
    L = _innovation_factor(gain, reduced)
    correction, square = np.zeros(STATES), 0.0
    for i in range(POSE):
        z = reduced[i, POSE]
        for k in range(i):
            z -= L[i, k] * L[k, POSE]
            _add_row(gain, i, -L[i, k], gain, k)
        L[i, POSE] = z / L[i, i]  # L⁻¹ z
        square += L[i, POSE] * L[i, POSE]
        for j in range(STATES):
            gain[i, j] /= L[i, i]
            correction[j] += L[i, POSE] * gain[i, j]
    for i in range(POSE - 1, -1, -1):
        for k in range(i + 1, POSE):
            _add_row(gain, i, -L[k, i], gain, k)
        for j in range(STATES):
            gain[i, j] /= L[i, i]
    return correction, _joseph_covariance(P, gain, reduced), square


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def _innovation_factor(UP: FloatArray, reduced: FloatArray) -> FloatArray:
    """Return the Cholesky factor L of S = U P Uᵀ + I, (6, 7), its last column free."""
    L = np.empty((POSE, POSE + 1))
    for i in range(POSE):
        for j in range(i + 1):
            s = 1.0 if i == j else 0.0
            for k in range(j, POSE):
                s += UP[i, k] * reduced[j, k]
            for k in range(j):
                s -= L[i, k] * L[j, k]
            L[i, j] = np.sqrt(s) if i == j else s / L[j, j]
    return L


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def _add_row(A: FloatArray, i: int, factor: float, B: FloatArray, k: int) -> None:
    for j in range(STATES):
        A[i, j] += factor * B[k, j]


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def _joseph_covariance(P: FloatArray, gain: FloatArray, reduced: FloatArray) -> FloatArray:
    """Return (I - K U) P (I - K U)ᵀ + K Kᵀ of Kᵀ (6, 12), row by row."""
    KU = np.empty((POSE, STATES))  # (K U)ᵀ
    for k in range(POSE):
        for j in range(STATES):
            KU[k, j] = _mix(reduced[:, k], gain, j)
    row = np.empty(STATES)
    updated = np.empty((STATES, STATES))
    for i in range(STATES):
        for j in range(STATES):
            row[j] = P[i, j] - _mix(KU[:, i], P, j)
        for j in range(STATES):
            updated[i, j] = row[j] - _mix(row, KU, j) + _mix(gain[:, i], gain, j)
    return symmetrize(updated)


@njit(cache=True)
def symmetrize(P: FloatArray) -> FloatArray:
    """Overwrite P by (P + Pᵀ) / 2 and return it."""
    for i in range(len(P)):
        for j in range(i):
            P[i, j] = P[j, i] = 0.5 * (P[i, j] + P[j, i])
    return P
