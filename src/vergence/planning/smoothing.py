"""The optimiser's kernel: a joint-space spline under visibility and joint limits.

Unknowns are the inner control points. The curve lies in the convex hull of its control points, so
joint limits on these hold all along it; they are enforced by projection. Visibility enters as
squared hinges at many samples, with exact gradients, and a weight that grows until none is active.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from vergence.arrays import FloatArray
from vergence.planning.visibility import View, add_visibility_penalty, clearance_at
from vergence.robot import Chain


class SplineProblem(NamedTuple):
    """The optimisation problem of a spline."""

    sight: View
    margin: float  # sine to keep from the sides of the view
    values: FloatArray  # (M, K)
    roughness: FloatArray  # (K, K)
    scale: FloatArray  # (n,) square of a joint's weight in the roughness
    low: FloatArray  # (n,)
    high: FloatArray  # (n,)


@njit(cache=True)
def spline_gradient(
    chain: Chain, problem: SplineProblem, C: FloatArray, weight: float
) -> tuple[float, FloatArray, FloatArray]:
    """Return cost, gradient (K n,) and Gauss-Newton matrix (K n, K n) at control points (K, n)."""
    K, n = C.shape
    M = len(problem.values)
    gradient, H = np.zeros(K * n), np.zeros((K * n, K * n))
    cost = 0.0
    for a in range(K):
        for b in range(max(0, a - 3), min(K, a + 4)):
            for i in range(n):
                stiffness = problem.roughness[a, b] * problem.scale[i]
                cost += 0.5 * stiffness * C[a, i] * C[b, i]
                gradient[a * n + i] += stiffness * C[b, i]
                H[a * n + i, b * n + i] += stiffness
    g, h = np.zeros(n), np.zeros((n, n))
    for k in range(M):
        row = problem.values[k]
        g[:], h[:] = 0.0, 0.0
        q = np.zeros(n)
        first = 0
        while row[first] == 0.0:
            first += 1
        last = min(K, first + 4)
        for a in range(first, last):
            for i in range(n):
                q[i] += row[a] * C[a, i]
        short = add_visibility_penalty(chain, q, problem.sight, problem.margin, weight / M, g, h)
        if short == 0.0:
            continue
        cost += short
        for a in range(first, last):
            for i in range(n):
                gradient[a * n + i] += row[a] * g[i]
                for b in range(first, last):
                    for j in range(n):
                        H[a * n + i, b * n + j] += row[a] * row[b] * h[i, j]
    return cost, gradient, H


@njit(cache=True)
def spline_cost(chain: Chain, problem: SplineProblem, C: FloatArray, weight: float) -> float:
    """Return only the cost."""
    K, n = C.shape
    cost = 0.0
    for a in range(K):
        for b in range(max(0, a - 3), min(K, a + 4)):
            for i in range(n):
                cost += 0.5 * problem.roughness[a, b] * problem.scale[i] * C[a, i] * C[b, i]
    g, h = np.zeros(n), np.zeros((n, n))
    for k in range(len(problem.values)):
        q = _point(problem.values[k], C)
        share = weight / len(problem.values)
        cost += add_visibility_penalty(chain, q, problem.sight, problem.margin, share, g, h)
    return cost


@njit(cache=True)
def _point(row: FloatArray, C: FloatArray) -> FloatArray:
    q = np.zeros(C.shape[1])
    for a in range(len(C)):
        if row[a] != 0.0:
            for i in range(len(q)):
                q[i] += row[a] * C[a, i]
    return q


@njit(cache=True)
def banded_solve(H: FloatArray, g: FloatArray, band: int) -> FloatArray:
    """Return H⁻¹ g for a positive definite H with H_ij = 0 for |i - j| > band (Cholesky)."""
    size = len(g)
    L, x = np.zeros((size, size)), g.copy()
    for i in range(size):
        start = max(0, i - band)
        for j in range(start, i + 1):
            total = H[i, j]
            for k in range(max(start, j - band), j):
                total -= L[i, k] * L[j, k]
            L[i, j] = np.sqrt(max(total, 1e-12)) if i == j else total / L[j, j]
        for k in range(start, i):
            x[i] -= L[i, k] * x[k]
        x[i] /= L[i, i]
    for i in range(size - 1, -1, -1):
        for k in range(i + 1, min(size, i + band + 1)):
            x[i] -= L[k, i] * x[k]
        x[i] /= L[i, i]
    return x


@njit(cache=True)
def spline_step(
    problem: SplineProblem, C: FloatArray, gradient: FloatArray, H: FloatArray, damping: float
) -> FloatArray:
    """Return control points after one damped step within the box; the ends do not move.

    A control point at a limit is held there if the gradient pushes it outwards.
    """
    K, n = C.shape
    A = H[n : (K - 1) * n, n : (K - 1) * n].copy()
    g = gradient[n : (K - 1) * n].copy()
    for r in range(len(g)):
        at, i = C[1 + r // n, r % n], r % n
        held = (at <= problem.low[i] and g[r] > 0.0) or (at >= problem.high[i] and g[r] < 0.0)
        if held:
            A[r, :], A[:, r], g[r] = 0.0, 0.0, 0.0
            A[r, r] = 1.0
        else:
            A[r, r] *= 1.0 + damping
            A[r, r] += 1e-9
    step = banded_solve(A, g, 4 * n - 1)
    moved = C.copy()
    for r in range(len(g)):
        i = r % n
        desired = C[1 + r // n, i] - step[r]
        moved[1 + r // n, i] = min(max(desired, problem.low[i]), problem.high[i])
    return moved


@njit(cache=True)
def least_clearance(chain: Chain, view: View, values: FloatArray, C: FloatArray) -> float:
    """Return the smallest sine to a side of the view over the samples of a spline."""
    least = np.inf
    for k in range(len(values)):
        least = min(least, clearance_at(chain, _point(values[k], C), view))
    return least


@njit(cache=True)
def optimise_spline(
    chain: Chain, problem: SplineProblem, C: FloatArray, stages: int, iterations: int
) -> tuple[FloatArray, float, float]:
    """Minimise roughness plus visibility, the weight of visibility rising fivefold each stage.

    Returns:
        control points (K, n), the roughness, and the least clearance over the samples.
    """
    C = C.copy()
    for a in range(1, len(C) - 1):
        C[a] = np.minimum(np.maximum(C[a], problem.low), problem.high)
    weight, damping, least = 200.0, 1e-3, -1.0
    for _ in range(stages):
        cost, gradient, H = spline_gradient(chain, problem, C, weight)
        damping = min(damping, 1e-2)
        for _ in range(iterations):
            candidate = spline_step(problem, C, gradient, H, damping)
            cost_new = spline_cost(chain, problem, candidate, weight)
            if cost_new < cost:
                gained = cost - cost_new
                C = candidate
                damping = max(0.2 * damping, 1e-9)
                cost, gradient, H = spline_gradient(chain, problem, C, weight)
                if gained < 1e-4 * cost:
                    break
            else:
                damping *= 6.0
                if damping > 1e6:
                    break
        least = least_clearance(chain, problem.sight, problem.values, C)
        if least >= 0.0:
            break
        weight *= 5.0
    return C, spline_cost(chain, problem, C, 0.0), least
