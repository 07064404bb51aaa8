"""A small quadratic program with constraints in priority order, by a dual active-set method."""

from typing import NamedTuple

import numpy as np
from numba import njit

from vergence.arrays import BoolArray, FloatArray, IntArray

_TOLERANCE = 1e-10
_MAX_STEPS = 200
_FAR = 1e5  # beyond what any row allows for x


class OrderedSolution(NamedTuple):
    """The optimum under the constraints, those of higher priority first."""

    x: FloatArray  # (n,)
    active: BoolArray  # (m,) rows that hold with equality and have a multiplier
    slack: FloatArray  # (m,) relaxation of each row; 0 for rows that hold
    solved: bool  # False if the iteration limit was reached: x must not be used


@njit(cache=True, error_model="numpy")
def solve_ordered_qp(
    H_inverse: FloatArray, g: FloatArray, C: FloatArray, d: FloatArray, priority: IntArray
) -> OrderedSolution:
    """Minimise ½ xᵀ H x - gᵀ x subject to C x ≥ d, relaxing rows of lower priority first.

    All rows are tried together. Only if they contradict each other are they added by priority, and
    of the conflicting rows the one of lowest priority is relaxed to its best possible value. If the
    dual method stops at that row itself, the value is known: by Farkas' lemma its normal is then a
    non-positive combination of the active normals, so no feasible point has a larger value.

    Args:
        H_inverse: inverse of the Hessian, (n, n), positive definite.
        g: linear term, (n,).
        C: one row per constraint, (m, n).
        d: right-hand sides, (m,); -inf for an unused row.
        priority: 0 for hard rows, then 1, 2, …; the largest number is relaxed first, (m,).
    """
    last = 0
    for i in range(len(priority)):
        last = max(last, priority[i])
    relaxed = d.copy()
    x, active, stuck, solved = solve_qp(H_inverse, g, C, relaxed, priority, last)
    if solved and stuck < 0:
        return OrderedSolution(x, active, np.zeros(len(d)), True)
    for up_to in range(last + 1):
        for _ in range(len(d) + 1):
            x, active, stuck, solved = solve_qp(H_inverse, g, C, relaxed, priority, up_to)
            if not solved:
                return OrderedSolution(x, active, np.zeros(len(d)), False)
            if stuck < 0:
                break
            relaxing = stuck
            for i in range(len(d)):  # the lowest priority in conflict is relaxed
                if active[i] and priority[i] > priority[relaxing]:
                    relaxing = i
            best = _value(C, relaxing, x)
            if relaxing != stuck:
                best = _best_value(H_inverse, C, relaxed, priority, relaxing)
            eased = best - 1e-9 * (1.0 + abs(best))
            relaxed[relaxing] = eased if eased < relaxed[relaxing] else -np.inf
    slack = np.zeros(len(d))
    for i in range(len(d)):
        violation = d[i] - _value(C, i, x)
        if violation > 1e-7:
            slack[i] = violation
    return OrderedSolution(x, active, slack, True)


@njit(cache=True, error_model="numpy")
def _value(C: FloatArray, row: int, x: FloatArray) -> float:
    """Return the row's left-hand side at x."""
    value = 0.0
    for j in range(len(x)):
        value += C[row, j] * x[j]
    return value


@njit(cache=True, error_model="numpy")
def _best_value(
    H_inverse: FloatArray, C: FloatArray, d: FloatArray, priority: IntArray, row: int
) -> float:
    """Return the largest value of a row given all rows before it, by a dominant linear term."""
    pull = C[row] / max(_value(C, row, H_inverse @ C[row]), 1e-300)
    x, _, _, _ = solve_qp(H_inverse, _FAR * pull, C, d, priority, priority[row] - 1)
    return _value(C, row, x)


@njit(cache=True, error_model="numpy")
def solve_qp(
    H_inverse: FloatArray,
    g: FloatArray,
    C: FloatArray,
    d: FloatArray,
    priority: IntArray,
    up_to: int,
) -> tuple[FloatArray, BoolArray, int, bool]:
    """Minimise ½ xᵀ H x - gᵀ x subject to the rows C x ≥ d of priority at most `up_to`.

    The dual method of Goldfarb and Idnani (1983): start at the unconstrained minimum and add the
    most violated row, moving along the active ones and dropping those whose multipliers become
    negative.

    Returns:
        x (n,), the active rows (m,), the row at which the constraints were found to contradict each
        other (-1 if they do not), and whether the method terminated.
    """
    n, m = len(g), len(d)
    x = H_inverse @ g
    active = np.zeros(m, dtype=np.bool_)
    working = np.empty(n + 1, dtype=np.int64)  # indices of the active rows
    multiplier = np.zeros(n + 1)
    count = 0
    HN = np.empty((n + 1, n))  # H⁻¹ times the active normals, one per row
    for _ in range(_MAX_STEPS):
        p, worst = -1, _TOLERANCE
        for i in range(m):
            if priority[i] > up_to or active[i] or d[i] == -np.inf:
                continue
            violation = d[i]
            for j in range(n):
                violation -= C[i, j] * x[j]
            if violation > worst:
                p, worst = i, violation
        if p < 0:
            return x, active, -1, True
        entering = 0.0
        while True:
            step, r = _directions(H_inverse, C, working, HN, count, p)
            curvature, normal, residual = 0.0, 0.0, d[p]
            for j in range(n):
                curvature += step[j] * C[p, j]
                normal += C[p, j] * C[p, j]
                residual -= C[p, j] * x[j]
            leaving, dual_length = -1, np.inf
            for k in range(count):
                if r[k] > _TOLERANCE and multiplier[k] / r[k] < dual_length:
                    leaving, dual_length = k, multiplier[k] / r[k]
            independent = curvature > 1e-11 * normal * H_inverse[0, 0] and count < n
            primal_length = residual / curvature if independent else np.inf
            length = min(dual_length, primal_length)
            if np.isinf(length):
                return x, active, p, True
            for k in range(count):
                multiplier[k] -= length * r[k]
            entering += length
            if independent:
                for j in range(n):
                    x[j] += length * step[j]
            if length == primal_length:
                working[count], multiplier[count] = p, entering
                for j in range(n):
                    HN[count, j] = 0.0
                    for i in range(n):
                        HN[count, j] += H_inverse[j, i] * C[p, i]
                active[p] = True
                count += 1
                break
            active[working[leaving]] = False
            count -= 1
            for k in range(leaving, count):
                working[k], multiplier[k] = working[k + 1], multiplier[k + 1]
                for j in range(n):
                    HN[k, j] = HN[k + 1, j]
    return x, active, -1, False


@njit(cache=True, error_model="numpy")
def _directions(
    H_inverse: FloatArray,
    C: FloatArray,
    working: IntArray,
    HN: FloatArray,
    count: int,
    p: int,
) -> tuple[FloatArray, FloatArray]:
    """Return the primal direction (n,) and that of the multipliers (count,) for adding row p.

    r = (Nᵀ H⁻¹ N)⁻¹ Nᵀ H⁻¹ n_p and z = H⁻¹ n_p - H⁻¹ N r, N the active normals.
    """
    n = len(H_inverse)
    z = np.zeros(n)
    for j in range(n):
        for i in range(n):
            z[j] += H_inverse[j, i] * C[p, i]
    G = np.zeros((count, count))  # Cholesky factor of Nᵀ H⁻¹ N
    r = np.zeros(count)
    for a in range(count):
        for b in range(a + 1):
            total = 0.0
            for j in range(n):
                total += C[working[a], j] * HN[b, j]
            for k in range(b):
                total -= G[a, k] * G[b, k]
            G[a, b] = np.sqrt(max(total, 1e-300)) if a == b else total / G[b, b]
        for j in range(n):
            r[a] += HN[a, j] * C[p, j]
        for k in range(a):
            r[a] -= G[a, k] * r[k]
        r[a] /= G[a, a]
    for a in range(count - 1, -1, -1):
        for k in range(a + 1, count):
            r[a] -= G[k, a] * r[k]
        r[a] /= G[a, a]
    for a in range(count):
        for j in range(n):
            z[j] -= r[a] * HN[a, j]
    return z, r
