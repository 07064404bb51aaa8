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
    PU = np.empty((STATES, POSE))  # P Uᵀ
    for i in range(STATES):
        for m in range(POSE):
            PU[i, m] = 0.0
            for k in range(m, POSE):
                PU[i, m] += P[i, k] * reduced[m, k]
    inverse = _innovation_inverse(PU, reduced)
    K, correction, square = np.empty((STATES, POSE)), np.zeros(STATES), 0.0
    for i in range(STATES):
        w = PU[i]
        for m in range(POSE):
            c = inverse[m]
            K[i, m] = (
                w[0] * c[0] + w[1] * c[1] + w[2] * c[2] + w[3] * c[3] + w[4] * c[4] + w[5] * c[5]
            )
            correction[i] += K[i, m] * reduced[m, POSE]
    for m in range(POSE):
        for k in range(POSE):
            square += reduced[m, POSE] * inverse[m, k] * reduced[k, POSE]
    return correction, _joseph_covariance(P, PU, K, reduced), square


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def _innovation_inverse(PU: FloatArray, reduced: FloatArray) -> FloatArray:
    """Return S⁻¹ of S = U P Uᵀ + I, (6, 6), by its Cholesky factor.

    The eigenvalues of S are 1 or more, and the Joseph form forgives a gain that is slightly off.
    """
    L = np.zeros((POSE, POSE))  # its diagonal inverted; then all of L⁻¹
    for i in range(POSE):
        for j in range(i + 1):
            s = 1.0 if i == j else 0.0
            for k in range(i, POSE):
                s += reduced[i, k] * PU[k, j]
            for k in range(j):
                s -= L[i, k] * L[j, k]
            L[i, j] = 1.0 / np.sqrt(s) if i == j else s * L[j, j]
    for j in range(POSE):
        for i in range(j + 1, POSE):
            s = 0.0
            for k in range(j, i):
                s -= L[i, k] * L[k, j]
            L[i, j] = s * L[i, i]
    inverse = np.empty((POSE, POSE))
    for i in range(POSE):
        for j in range(i + 1):
            s = 0.0
            for k in range(i, POSE):
                s += L[k, i] * L[k, j]
            inverse[i, j] = inverse[j, i] = s
    return inverse


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def _joseph_covariance(
    P: FloatArray, PU: FloatArray, K: FloatArray, reduced: FloatArray
) -> FloatArray:
    """Return X (I - K U)ᵀ + K Kᵀ = X + (K - X Uᵀ) Kᵀ with X = (I - K U) P = P - K (P Uᵀ)ᵀ.

    Row by row, one triangle and its mirror image. The sums over six are written out: they then run
    in registers, at half the time.
    """
    x, g = np.empty(STATES), np.empty(POSE)  # a row of X, and of K - X Uᵀ
    updated = np.empty((STATES, STATES))
    for i in range(STATES):
        a0, a1, a2, a3, a4, a5 = K[i, 0], K[i, 1], K[i, 2], K[i, 3], K[i, 4], K[i, 5]
        for j in range(max(POSE, i + 1)):
            w = PU[j]
            lost = a0 * w[0] + a1 * w[1] + a2 * w[2] + a3 * w[3] + a4 * w[4] + a5 * w[5]
            x[j] = P[i, j] - lost
        for m in range(POSE):
            g[m] = K[i, m]
            for k in range(m, POSE):
                g[m] -= x[k] * reduced[m, k]
        g0, g1, g2, g3, g4, g5 = g[0], g[1], g[2], g[3], g[4], g[5]
        for j in range(i + 1):
            c = K[j]
            added = g0 * c[0] + g1 * c[1] + g2 * c[2] + g3 * c[3] + g4 * c[4] + g5 * c[5]
            updated[i, j] = updated[j, i] = x[j] + added
    return updated
