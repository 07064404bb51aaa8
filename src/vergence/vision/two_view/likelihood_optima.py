"""The local optima of the likelihood of all matches, each of which may be wrong.

A wrong match close to its epipolar line attracts the best motion until it agrees, and a motion that
other matches explain may be nearly as likely. The optima are sought from motions of five matches,
and from the best motion without each match that it hinges on.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from vergence.arrays import BoolArray, FloatArray
from vergence.geometry import so3_exp, so3_log
from vergence.vision.two_view.evidence import log_densities
from vergence.vision.two_view.motions import choose_motion, essential
from vergence.vision.two_view.sampson import (
    refine_essential,
    sampson_jacobian,
    sampson_residuals,
    tangent_basis,
)
from vergence.vision.two_view.small import (
    apply,
    cholesky_inverse,
    dot,
    times,
    transposed_apply,
    transposed_times,
    unit,
)

UNLIKELY = 25.0  # χ² above the best up to which motions are of interest
_OPTIMA = 24  # largest number of local optima
_REFINEMENTS = 3  # of an optimum, and of the matches that agree with it
_DISTINCT = 4.0  # χ² between two optima, by the information of either
_HINGE = 0.7  # leverage of a match on which the motion hinges
NOISIER = float(np.log(4.0))  # largest ratio of the noise to the stated one
_ROUNDS = 3  # of estimating the noise of right matches
_FACTORS = 16  # likelihoods multiplied before their logarithm is taken
_MANY = 16  # matches from which the noise can be estimated
_FEWEST = 6  # matches that determine a motion with one to spare


class Likelihood(NamedTuple):
    """The likelihood of motions given matches, each of which may be wrong."""

    m_star: FloatArray  # (N, 2) in the desired view, normalized
    m: FloatArray  # (N, 2) in the current view
    noise: float  # stated standard deviation of a coordinate
    wrong: float  # density of a wrong match's Sampson distance, over that of a right one's e⁻⁰/σ


def likelihood_of(m_star: FloatArray, m: FloatArray, noise: float, dropped: int) -> Likelihood:
    """Return the likelihood of matches (N, 2) of which some do not agree with the best motion.

    A wrong match lies anywhere in the region that the matches cover: its Sampson distance, which is
    its distance from the line over √2, has the density √2 D/A.
    """
    share = (dropped + 1.0) / (len(m) + 2.0)
    _, band = log_densities(m_star, m)
    wrong = share / (1.0 - share) * np.sqrt(2.0 * np.pi) * np.sqrt(0.5) * float(np.exp(band))
    return Likelihood(m_star, m, noise, wrong)


@njit(cache=True)
def unlikelihood(likelihood: Likelihood, E: FloatArray, log_noise: float) -> float:
    """Return −2 log of the likelihood of an essential matrix, up to a constant.

    Args:
        likelihood: of the matches.
        E: the matrix, (3, 3).
        log_noise: logarithm of the noise over the stated one.
    """
    residuals = sampson_residuals(E, likelihood.m_star, likelihood.m)
    return unlikelihood_of(residuals, likelihood.wrong, likelihood.noise * np.exp(log_noise))[0]


@njit(cache=True)
def unlikelihood_of(residuals: FloatArray, wrong: float, deviation: float) -> tuple[float, float]:
    """Return −2 log of the likelihood of residuals (N,), and the deviation of right ones."""
    total, product, squares, weights = 0.0, 1.0, 0.0, 0.0
    for j in range(len(residuals)):
        square = residuals[j] ** 2
        right = np.exp(-0.5 * square / deviation**2) / deviation
        share = right / (right + wrong)
        squares += share * square
        weights += share
        product *= right + wrong
        if j % _FACTORS == _FACTORS - 1:
            total -= 2.0 * np.log(product)
            product = 1.0
    return total - 2.0 * np.log(product), np.sqrt(squares / max(weights, 1e-300))


@njit(cache=True)
def least_unlikelihood(likelihood: Likelihood, E: FloatArray, log_noise: float) -> float:
    """Return the least unlikelihood of an essential matrix over the possible noises.

    Few matches do not tell their noise; for many, it is that of the matches that are right, which
    is found by expectation maximisation.
    """
    residuals = sampson_residuals(E, likelihood.m_star, likelihood.m)
    deviation = likelihood.noise * np.exp(log_noise)
    least, told = unlikelihood_of(residuals, likelihood.wrong, deviation)
    if len(likelihood.m) >= _MANY:
        for _ in range(_ROUNDS):
            deviation = likelihood.noise * min(max(told / likelihood.noise, 1.0), np.exp(NOISIER))
            here, told = unlikelihood_of(residuals, likelihood.wrong, deviation)
            least = min(least, here)
    return least


@njit(cache=True)
def motion_at(R: FloatArray, t: FloatArray, x: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the motion at x = (ω, τ) about (R, t): exp(ω) R, and t + B τ normalised."""
    turned = times(so3_exp(x[:3].copy()), R)
    return turned, unit(t + apply(tangent_basis(t), x[3:5].copy()))


class Optima(NamedTuple):
    """Local optima of the likelihood, the best motion first."""

    R: FloatArray  # (K, 3, 3)
    t: FloatArray  # (K, 3), unit
    right: BoolArray  # (K, N) matches that determine each


@njit(cache=True)
def likely_matches(likelihood: Likelihood, E: FloatArray, log_noise: float) -> BoolArray:
    """Return which matches (N,) are more likely right than wrong under a motion."""
    deviation = likelihood.noise * np.exp(log_noise)
    gate = deviation * np.sqrt(2.0 * max(-np.log(likelihood.wrong * deviation), 1.0))
    near: BoolArray = np.abs(sampson_residuals(E, likelihood.m_star, likelihood.m)) < gate
    return near


@njit(cache=True)
def settled_motion(
    likelihood: Likelihood, E: FloatArray, log_noise: float
) -> tuple[FloatArray, FloatArray, BoolArray]:
    """Return the motion near E that best explains the matches that agree with it, and those."""
    near = likely_matches(likelihood, E, log_noise + np.log(2.0))
    R, t = np.eye(3), np.zeros(3)
    for _ in range(_REFINEMENTS):
        if np.sum(near) < _FEWEST:
            break
        m_star, m = likelihood.m_star[near], likelihood.m[near]
        R, t, _ = choose_motion(E, m_star, m)
        R, t, _ = refine_essential(R, t, m_star, m, 6)
        E = essential(R, t)
        again = likely_matches(likelihood, E, log_noise)
        if (again == near).all():
            break
        near = again
    return R, t, near


@njit(cache=True)
def information_of(
    likelihood: Likelihood, R: FloatArray, t: FloatArray, right: BoolArray, log_noise: float
) -> FloatArray:
    """Return the information of the right matches on (ω, τ), (5, 5)."""
    J = sampson_jacobian(R, t, likelihood.m_star[right], likelihood.m[right])
    J /= likelihood.noise * np.exp(log_noise)
    return transposed_times(J, J)


@njit(cache=True)
def without_one(
    likelihood: Likelihood, R: FloatArray, t: FloatArray, right: BoolArray, log_noise: float
) -> BoolArray:
    """Return the right matches less each one that the motion hinges on, (≤ N, N)."""
    J = sampson_jacobian(R, t, likelihood.m_star, likelihood.m)
    J /= likelihood.noise * np.exp(log_noise)
    C = cholesky_inverse(transposed_times(J[right], J[right]))
    leverage = np.array([dot(row, apply(C, row)) for row in J])
    hinges = np.flatnonzero(right & (leverage > _HINGE))
    masks = np.empty((len(hinges), len(right)), dtype=np.bool_)
    for k in range(len(hinges)):
        masks[k] = right
        masks[k, hinges[k]] = False
    return masks


@njit(cache=True)
def local_optima(
    likelihood: Likelihood, R: FloatArray, t: FloatArray, log_noise: float, matrices: FloatArray
) -> Optima:
    """Return distinct local optima of the likelihood.

    Args:
        likelihood: of the matches.
        R: of the best motion, (3, 3).
        t: of the best motion, unit, (3,).
        log_noise: logarithm of the noise over the stated one.
        matrices: essential matrices near which there may be others, (M, 3, 3).
    """
    count = len(likelihood.m)
    rotations, translations = np.empty((_OPTIMA, 3, 3)), np.empty((_OPTIMA, 3))
    masks = np.empty((_OPTIMA, count), dtype=np.bool_)
    best = likely_matches(likelihood, essential(R, t), log_noise)
    rotations[0], translations[0], masks[0], k = R, t, best, 1
    information = np.empty((_OPTIMA, 5, 5))
    information[0] = information_of(likelihood, R, t, best, log_noise)
    for right in without_one(likelihood, R, t, best, log_noise):
        if np.sum(right) >= _FEWEST and k < _OPTIMA:
            R_k, t_k, _ = refine_essential(R, t, likelihood.m_star[right], likelihood.m[right], 6)
            rotations[k], translations[k], masks[k] = R_k, t_k, right
            information[k] = information_of(likelihood, R_k, t_k, right, log_noise)
            k += 1
    highest = unlikelihood(likelihood, essential(R, t), log_noise) + UNLIKELY
    unlikely = np.array([unlikelihood(likelihood, E, log_noise + np.log(2.0)) for E in matrices])
    for at in np.argsort(unlikely)[: 4 * _OPTIMA]:
        if k == _OPTIMA:
            break
        R_k, t_k, right = settled_motion(likelihood, matrices[at], log_noise)
        if np.sum(right) < _FEWEST:
            continue
        if unlikelihood(likelihood, essential(R_k, t_k), log_noise) > highest:
            continue
        rotations[k], translations[k], masks[k] = R_k, t_k, right
        information[k] = information_of(likelihood, R_k, t_k, right, log_noise)
        new = True
        for i in range(k):
            d = step_between(rotations[i], translations[i], R_k, t_k)
            for j in (i, k):
                new = new and dot(d, apply(information[j], d)) > _DISTINCT
        k += new
    return Optima(rotations[:k], translations[:k], masks[:k])


@njit(cache=True)
def step_between(
    R: FloatArray, t: FloatArray, R_there: FloatArray, t_there: FloatArray
) -> FloatArray:
    """Return (ω, τ) from one motion to another, (5,)."""
    d = np.empty(5)
    d[:3] = so3_log(times(R_there, R.T.copy()))
    d[3:] = transposed_apply(tangent_basis(t), t_there - t)
    return d
