"""Motions of an object of any shape that the matches allow beside the best one.

The error of a motion has narrow, curved valleys, since rotation and sideways translation look
alike, which the covariance at the minimum does not show. The valley through each local optimum of
the likelihood is therefore followed both ways, and over the surface that it is if two directions
are weak; motions are drawn about the points on the way, and the covariance is widened to contain
each of them. Valleys bend, so steps and draws are short, and there are many of them.
"""

import numpy as np
from numba import njit

from vergence.arrays import BoolArray, FloatArray
from vergence.geometry import so3_log
from vergence.vision.two_view.covariance import reference_plane
from vergence.vision.two_view.decomposition import inverse_depths
from vergence.vision.two_view.likelihood_optima import (
    NOISIER,
    UNLIKELY,
    Likelihood,
    Optima,
    information_of,
    least_unlikelihood,
    local_optima,
    motion_at,
    unlikelihood,
)
from vergence.vision.two_view.linear import homogeneous
from vergence.vision.two_view.motions import essential
from vergence.vision.two_view.sampson import sampson_jacobian, sampson_residuals
from vergence.vision.two_view.small import apply, dot, symmetric_eigen, times, transposed_apply
from vergence.vision.two_view.widening import SLACK, upsilon_between, widen

_STEPS = 12  # along a valley, each way
_HALF = np.sqrt(0.5)
_HEADINGS = np.array(  # along the two weakest directions of a valley, deviations
    [
        *((1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)),
        *((_HALF, _HALF), (-_HALF, -_HALF), (_HALF, -_HALF), (-_HALF, _HALF)),
    ]
)
_BENT = 0.05  # rad: deviation beyond which a direction bends
_DRAWS = 1.3 * np.random.default_rng(0).normal(size=(40, 5))  # about each point of a valley
# Of the points of the reference plane, in deviations along three axes, at the bottom of a valley.
_NOISES = np.concatenate(
    (np.zeros((1, 3)), *(size * axis * np.eye(3) for size in (1.5,) for axis in (-1, 1)))
)
_NOISES_DRAWN = np.random.default_rng(1).normal(size=(len(_DRAWS), 4, 3))  # at each draw
_NOISES_DRAWN[:, 0] = 0.0
_RARE = 14.0  # χ² of noise and place in the valley together that one in a thousand exceeds
_FARTHEST = 1e-4  # smallest inverse depth, relative to that of the translation
_LEAST_INFORMATION = 1.0 / 0.15**2  # rad⁻²: valleys bend, so no step is longer than 0.15 rad
_STEP = 1e-6  # of a numerical derivative
_FAR = 30.0  # χ² above which a motion is ignored
_ASIDE = 1.33  # factor on χ² of what is drawn
_LEAST = 16.0  # χ² below which a motion counts as that far


@njit(cache=True)
def along_valley(
    likelihood: Likelihood,
    R: FloatArray,
    t: FloatArray,
    right: BoolArray,
    log_noise: float,
    highest: float,
) -> tuple[FloatArray, FloatArray, FloatArray, int]:
    """Return motions along the valley of the error through an optimum, the given first.

    Each step goes by a deviation along the weakest direction, which turns on the way, then back to
    the bottom of the valley by a step along the others. Where a second direction is so weak that
    the valley is a bent surface, it is followed along both, and between them.

    Args:
        likelihood: of all matches.
        R: of the optimum, (3, 3).
        t: of the optimum, unit, (3,).
        right: mask of the matches that determine the valley, (N,).
        log_noise: logarithm of the noise over the stated one.
        highest: unlikelihood at which the valley ends.

    Returns:
        R (K, 3, 3), t (K, 3), the deviations of (ω, τ) about each, the weakest first, by columns
        (K, 5, 5), and the number of weak directions.
    """
    most = len(_HEADINGS) * _STEPS + 1
    rotations, translations = np.empty((most, 3, 3)), np.empty((most, 3))
    spreads = np.empty((most, 5, 5))
    rotations[0], translations[0], found = R, t, 1
    spreads[0] = local_spread(likelihood, R, t, right, log_noise)
    second = spreads[0, :, 1].copy()
    weak = 2 if dot(second, second) > _BENT**2 else 1
    for course in _HEADINGS if weak > 1 else _HEADINGS[:2]:
        R_k, t_k, heading = R, t, apply(spreads[0, :, :2].copy(), course)
        for _ in range(_STEPS):
            R_k, t_k = motion_at(R_k, t_k, heading)
            spread = local_spread(likelihood, R_k, t_k, right, log_noise)
            gradient = gradient_of(likelihood, R_k, t_k, right, log_noise)
            step = np.zeros(5)
            for k in range(weak, 5):
                v = spread[:, k].copy()
                step -= v * dot(v, gradient)
            R_k, t_k = motion_at(R_k, t_k, step)
            if not unlikelihood(likelihood, essential(R_k, t_k), log_noise) < highest:
                break
            spread = local_spread(likelihood, R_k, t_k, right, log_noise)
            rotations[found], translations[found], spreads[found] = R_k, t_k, spread
            heading = ahead(heading, spread[:, :weak].copy())
            found += 1
    return rotations[:found], translations[:found], spreads[:found], weak


@njit(cache=True)
def ahead(heading: FloatArray, axes: FloatArray) -> FloatArray:
    """Return the step of one deviation along axes (5, K) that turns least from a heading (5,)."""
    step, square = np.zeros(5), 0.0
    for k in range(axes.shape[1]):
        v = axes[:, k].copy()
        share = dot(v, heading) / dot(v, v)
        step += share * v
        square += share**2
    ahead: FloatArray = step / np.sqrt(max(square, 1e-300))
    return ahead


@njit(cache=True)
def local_spread(
    likelihood: Likelihood, R: FloatArray, t: FloatArray, right: BoolArray, log_noise: float
) -> FloatArray:
    """Return deviations along the axes of the error of right matches, weakest first, (5, 5)."""
    values, vectors = symmetric_eigen(information_of(likelihood, R, t, right, log_noise))
    for k in range(5):
        vectors[:, k] /= np.sqrt(max(values[k], _LEAST_INFORMATION))
    return vectors


@njit(cache=True)
def gradient_of(
    likelihood: Likelihood, R: FloatArray, t: FloatArray, right: BoolArray, log_noise: float
) -> FloatArray:
    """Return the gradient of half the χ² of the right matches by (ω, τ), (5,)."""
    m_star, m = likelihood.m_star[right], likelihood.m[right]
    residuals = sampson_residuals(essential(R, t), m_star, m)
    J = sampson_jacobian(R, t, m_star, m)
    J /= (likelihood.noise * np.exp(log_noise)) ** 2
    return transposed_apply(J, residuals)


@njit(cache=True)
def widen_for_likely(
    covariance: FloatArray,
    likelihood: Likelihood,
    R: FloatArray,
    t: FloatArray,
    log_noise: float,
    optima: Optima,
    m_star: FloatArray,
    m: FloatArray,
) -> bool:
    """Let the covariance of Υ contain the likely motions, in place.

    Args:
        covariance: of the best motion, (6, 6).
        likelihood: of all matches.
        R: of the best motion, (3, 3).
        t: of the best motion, unit, (3,).
        log_noise: logarithm of the noise over the stated one.
        optima: of the likelihood.
        m_star: points of the reference plane in the desired view, normalized, (P, 2).
        m: the same points in the current view, (P, 2).

    Returns:
        Whether the reference plane lies in front of both cameras.
    """
    t_d, behind = translation_over_distance(R, t, m_star, m)
    if behind:
        return False
    upsilon = np.concatenate((t_d, so3_log(R.T.copy())))
    least = least_unlikelihood(likelihood, essential(R, t), log_noise)
    covariances, differences = covariance.reshape(1, 6, 6), np.empty((1, 6))
    axes = likelihood.noise * np.exp(log_noise) * plane_noises(R, t, m_star, m)
    for k in range(len(optima.t)):
        R_way, t_way, spreads, weak = along_valley(
            likelihood, optima.R[k], optima.t[k], optima.right[k], log_noise, least + UNLIKELY
        )
        draws = _DRAWS[: len(_DRAWS) // weak**2]
        for i in range(len(R_way)):
            for j in range(len(draws) + 1):
                R_j, t_j, noises = R_way[i], t_way[i], _NOISES
                if j < len(draws):
                    R_j, t_j = motion_at(R_j, t_j, apply(spreads[i], draws[j]))
                    noises = _NOISES_DRAWN[j]
                above = least_unlikelihood(likelihood, essential(R_j, t_j), log_noise) - least
                for noise in noises:
                    square = dot(noise, noise)
                    if above + square > (_FAR if square == 0.0 else _RARE):
                        continue
                    moved = noise[0] * axes[0] + noise[1] * axes[1] + noise[2] * axes[2]
                    t_d, behind = translation_over_distance(
                        R_j, t_j, m_star + moved[:, :2], m + moved[:, 2:]
                    )
                    if not behind:
                        differences[0] = upsilon_between(upsilon, R_j.T.copy(), t_d)
                        aside = max(_ASIDE * above + square, _LEAST)
                        widen(covariances, differences, SLACK * aside)
    return True


@njit(cache=True)
def plane_noises(R: FloatArray, t: FloatArray, m_star: FloatArray, m: FloatArray) -> FloatArray:
    """Return the three unit changes of the reference plane's points that turn it, (3, P, 4).

    They are at right angles, the one that changes N = n*/d* most last. The first two columns are of
    the desired view, the others of the current one.
    """
    N, _ = plane_through(R, t, m_star, m)
    slopes = np.zeros((3, 4 * len(m)))
    for p in range(len(m)):
        for axis in range(4):
            moved_star, moved = m_star.copy(), m.copy()
            if axis < 2:
                moved_star[p, axis] += _STEP
            else:
                moved[p, axis - 2] += _STEP
            there, behind = plane_through(R, t, moved_star, moved)
            if not behind:
                slopes[:, 4 * p + axis] = there - N
    values, vectors = symmetric_eigen(times(slopes, slopes.T.copy()))
    axes = np.empty((3, len(m), 4))
    for k in range(3):
        change = transposed_apply(slopes, vectors[:, k].copy()) / np.sqrt(max(values[k], 1e-300))
        axes[k] = change.reshape(len(m), 4)
    return axes


def covariance_of_likely(
    covariance: FloatArray,
    likelihood: Likelihood,
    R: FloatArray,
    t: FloatArray,
    scale: float,
    matrices: FloatArray,
    m_star: FloatArray,
    m: FloatArray,
) -> FloatArray | None:
    """Return a covariance of Υ that contains the likely motions, (6, 6).

    Args:
        covariance: at the best motion, (6, 6).
        likelihood: of all matches.
        R: of the best motion, (3, 3).
        t: of the best motion, unit, (3,).
        scale: variance of the noise over the stated one.
        matrices: essential matrices near which there may be optima, (K, 3, 3).
        m_star: points of the reference plane in the desired view, normalized, (P, 2).
        m: the same points in the current view, (P, 2).

    Returns:
        The covariance, or None if the reference plane lies behind a camera.
    """
    log_noise = min(0.5 * float(np.log(scale)), NOISIER)
    optima = local_optima(likelihood, R, t, log_noise, matrices)
    widened = covariance.copy()
    in_front = widen_for_likely(widened, likelihood, R, t, log_noise, optima, m_star, m)
    return widened if in_front else None


@njit(cache=True)
def translation_over_distance(
    R: FloatArray, t: FloatArray, m_star: FloatArray, m: FloatArray
) -> tuple[FloatArray, bool]:
    """Return t_d = *t_c / d*, (3,), by the reference plane's points, and whether one is behind.

    Args:
        R: of the motion, (3, 3).
        t: of the motion, unit, (3,).
        m_star: points of the plane in the desired view, normalized, (K, 2).
        m: the same points in the current view, (K, 2).
    """
    N, behind = plane_through(R, t, m_star, m)
    return -np.sqrt(dot(N, N)) * transposed_apply(R, t), behind


@njit(cache=True)
def plane_through(
    R: FloatArray, t: FloatArray, m_star: FloatArray, m: FloatArray
) -> tuple[FloatArray, bool]:
    """Return N = n*/d* of the plane of points, (3,), and whether one of them is behind a camera."""
    inverse, _ = inverse_depths(R, t, m_star, m)
    if inverse.min() <= _FARTHEST:
        return np.zeros(3), True
    points = homogeneous(m_star)
    for k in range(len(points)):
        points[k] /= inverse[k]
    return reference_plane(points), False
