"""Motions of an object of any shape that explain its matches nearly as well, for its covariance.

A fit to matches moved by noise lands where noise could have put the motion, along a valley of the
error that bends, too. A fit to matches with random weights lands where the motion would be without
some of them: one wrong match, near enough to its epipolar line, may bend it towards itself.
"""

import numpy as np
from numba import njit

from vergence.arrays import FloatArray, IntArray
from vergence.geometry import skew, so3_exp, so3_log
from vergence.vision.two_view.covariance import reference_plane
from vergence.vision.two_view.decomposition import inverse_depths
from vergence.vision.two_view.linear import homogeneous
from vergence.vision.two_view.sampson import sampson_jacobian, sampson_residuals, tangent_basis
from vergence.vision.two_view.small import (
    apply,
    cholesky_solve,
    dot,
    times,
    transposed_apply,
    unit,
)
from vergence.vision.two_view.widening import upsilon_between, widen

_CAP = 13.8  # of χ² that a single match adds: it may be wrong
_REPLICAS = 48
_STEPS = 8  # most of a fit
_UNLIKELY = 60.0  # χ² above the best from which on a motion is not looked at
_FARTHEST = 1e-4  # least inverse depth, over that of the translation


@njit(cache=True)
def capped_error(
    R: FloatArray, t: FloatArray, m_star: FloatArray, m: FloatArray, variance: float
) -> float:
    """Return χ² of the Sampson distances, with what a single match adds capped."""
    total = 0.0
    for residual in sampson_residuals(times(skew(t), R), m_star, m):
        total += min(residual**2 / variance, _CAP)
    return total


@njit(cache=True)
def refit(
    R: FloatArray,
    t: FloatArray,
    m_star: FloatArray,
    m: FloatArray,
    weights: FloatArray,
    variance: float,
) -> tuple[FloatArray, FloatArray]:
    """Minimise the weighted and capped χ² over R and the direction of t, from a first guess.

    Args:
        R: first guess, (3, 3).
        t: first guess, unit, (3,).
        m_star: points in the desired view, normalized, (N, 2).
        m: the same points in the current view, (N, 2).
        weights: of the matches, (N,).
        variance: of a normalized coordinate.
    """
    residuals = sampson_residuals(times(skew(t), R), m_star, m)
    cost, damping = np.inf, 1e-3
    for _ in range(_STEPS):
        J = sampson_jacobian(R, t, m_star, m)
        S, g, cost = np.zeros((5, 5)), np.zeros(5), 0.0
        for j in range(len(m)):
            square = residuals[j] ** 2 / variance
            cost += weights[j] * min(square, _CAP)
            if square < _CAP:
                for a in range(5):
                    g[a] += weights[j] * J[j, a] * residuals[j]
                    for b in range(5):
                        S[a, b] += weights[j] * J[j, a] * J[j, b]
        better = False
        while not better and damping < 1e4:
            A = S.copy()
            for k in range(5):
                A[k, k] += damping * S[k, k] + 1e-12
            delta = -cholesky_solve(A, g.copy().reshape(5, 1))[:, 0]
            R_new = times(so3_exp(delta[:3]), R)
            t_new = unit(t + apply(tangent_basis(t), delta[3:]))
            trial = sampson_residuals(times(skew(t_new), R_new), m_star, m)
            cost_new = 0.0
            for j in range(len(m)):
                cost_new += weights[j] * min(trial[j] ** 2 / variance, _CAP)
            better = cost_new < cost
            damping *= 0.1 if better else 10.0
        if not better:
            break
        R, t, residuals = R_new, t_new, trial
        if cost - cost_new < 0.05:
            break
    return R, t


@njit(cache=True)
def widen_for_general(
    covariance: FloatArray,
    R: FloatArray,
    t: FloatArray,
    m_star: FloatArray,
    m: FloatArray,
    variance: float,
    reference: IntArray,
    noise: FloatArray,
    weights: FloatArray,
) -> None:
    """Let a motion contain those that fits to other noise and other weights lead to, in place.

    Args:
        covariance: of Υ, (1, 6, 6).
        R: of the motion, (3, 3).
        t: of the motion, unit, (3,).
        m_star: points in the desired view, normalized, (N, 2).
        m: the same points in the current view, (N, 2).
        variance: of a normalized coordinate.
        reference: indices of the points that span the reference plane, (K,).
        noise: of the four coordinates of each match, standard normal or 0, (B, N, 4).
        weights: of the matches, (B, N).
    """
    star, now = m_star[reference], m[reference]
    t_d, behind = translation_over_distance(R, t, star, now)
    if behind:
        return
    upsilon = np.concatenate((t_d, so3_log(R.T.copy())))
    least = capped_error(R, t, m_star, m, variance)
    for b in range(len(noise)):
        shift = np.sqrt(variance) * noise[b]
        R_b, t_b = refit(R, t, m_star + shift[:, :2], m + shift[:, 2:], weights[b], variance)
        above = capped_error(R_b, t_b, m_star, m, variance) - least
        t_d, behind = translation_over_distance(R_b, t_b, star, now)
        if above < _UNLIKELY and not behind:
            difference = upsilon_between(upsilon, R_b.T.copy(), t_d)
            widen(covariance, difference.reshape(1, 6), above)


@njit(cache=True)
def translation_over_distance(
    R: FloatArray, t: FloatArray, m_star: FloatArray, m: FloatArray
) -> tuple[FloatArray, bool]:
    """Return t_d = *t_c / d*, (3,), from the points of the reference plane; whether one is behind.

    Args:
        R: of the motion, (3, 3).
        t: of the motion, unit, (3,).
        m_star: points of the plane in the desired view, normalized, (K, 2).
        m: the same points in the current view, (K, 2).
    """
    inverse, _ = inverse_depths(R, t, m_star, m)
    if inverse.min() <= _FARTHEST:
        return np.zeros(3), True
    points = homogeneous(m_star)
    for k in range(len(points)):
        points[k] /= inverse[k]
    N = reference_plane(points)
    return -np.sqrt(dot(N, N)) * transposed_apply(R, t), False


def draw_replicas(count: int) -> tuple[FloatArray, FloatArray]:
    """Return noise (B, N, 4) and weights (B, N) of fits: half have noise, half random weights."""
    random = np.random.default_rng(0)
    noise = random.normal(size=(_REPLICAS, count, 4))
    weights = random.exponential(size=(_REPLICAS, count))
    noise[1::2], weights[::2] = 0.0, 1.0
    return noise, weights
