"""Motions of an object of any shape, sampled according to the likelihood of the matches.

The error of a motion has narrow, curved valleys, since rotation and sideways translation look
alike; and a wrong match close to its epipolar line attracts the best motion. Neither is visible in
the covariance at the minimum. Motions are therefore sampled from the likelihood of all matches,
each of which may be wrong, and the covariance is that of the samples about the best motion.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from vergence.arrays import FloatArray, IntArray
from vergence.geometry import skew, so3_exp, so3_log
from vergence.vision.two_view.covariance import reference_plane
from vergence.vision.two_view.decomposition import inverse_depths
from vergence.vision.two_view.evidence import log_densities
from vergence.vision.two_view.linear import homogeneous
from vergence.vision.two_view.motions import choose_motion
from vergence.vision.two_view.sampson import (
    refine_essential,
    sampson_jacobian,
    sampson_residuals,
    tangent_basis,
)
from vergence.vision.two_view.search import sampled_motions
from vergence.vision.two_view.small import (
    apply,
    dot,
    symmetric_eigen,
    times,
    transposed_apply,
    transposed_times,
    unit,
)
from vergence.vision.two_view.widening import upsilon_between, widen

TEMPERATURE = 3.0  # of the sampling, to include unlikely motions; the moments are reweighted
_WALKERS, _ROUNDS, _SETTLING = 48, 60, 20
_STARTS = 24  # walkers that start from motions of five matches
_NOISIER = np.log(4.0)  # largest ratio of the noise to the stated one
_MANY = 16  # matches from which the noise can be estimated
_FARTHEST = 1e-4  # smallest inverse depth, relative to that of the translation
_FEWEST = 50  # samples with their reference plane in front of both cameras
_LEAST = 16.0  # χ² below which a sample does not widen the covariance: the moments include it
_ASIDE = 1.33  # factor on χ² relative to that of the samples: what their moments may miss
_AHEAD = 0.1  # smallest cosine between the translation directions of a sample and the best motion


class Likelihood(NamedTuple):
    """The likelihood of motions given matches, each of which may be wrong."""

    m_star: FloatArray  # (N, 2) in the desired view, normalized
    m: FloatArray  # (N, 2) in the current view
    noise: float  # stated standard deviation of a coordinate
    wrong: float  # density of a wrong match's Sampson distance, over that of a right one's e⁻⁰/σ


class Draws(NamedTuple):
    """The random numbers of a differential-evolution Markov chain, for each round and walker."""

    partners: IntArray  # (G, K, 2) two other walkers, whose difference is the step
    length: FloatArray  # (G, K) factor on the step
    jitter: FloatArray  # (G, K, 6) standard normal
    threshold: FloatArray  # (G, K) −2 log of a uniform number


def _draws() -> Draws:
    random = np.random.default_rng(0)
    size = (_ROUNDS, _WALKERS)
    first = random.integers(1, _WALKERS, size)
    second = 1 + (first - 1 + random.integers(1, _WALKERS - 1, size)) % (_WALKERS - 1)
    return Draws(
        (np.arange(_WALKERS)[:, None] + np.stack((first, second), axis=-1)) % _WALKERS,
        np.where(random.uniform(size=size) < 0.1, 1.0, 0.7),
        random.normal(size=(*size, 6)),
        -2.0 * np.log(random.uniform(size=size)),
    )


_DRAWS = _draws()


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
    deviation = likelihood.noise * np.exp(log_noise)
    total = 0.0
    for residual in sampson_residuals(E, likelihood.m_star, likelihood.m):
        right = np.exp(-0.5 * (residual / deviation) ** 2) / deviation
        total -= 2.0 * np.log(right + likelihood.wrong)
    return total


@njit(cache=True)
def motion_at(R: FloatArray, t: FloatArray, x: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the motion at x = (ω, τ, …) about (R, t): exp(ω) R, and t + B τ normalised."""
    turned = times(so3_exp(x[:3].copy()), R)
    return turned, unit(t + apply(tangent_basis(t), x[3:5].copy()))


@njit(cache=True)
def starting_walkers(
    likelihood: Likelihood,
    R: FloatArray,
    t: FloatArray,
    log_noise: float,
    matrices: FloatArray,
    count: int,
) -> FloatArray:
    """Return initial walkers, (≤ count, 6): the most likely motions of five matches, refined."""
    unlikely = np.empty(len(matrices))
    for k in range(len(matrices)):
        unlikely[k] = unlikelihood(likelihood, matrices[k], log_noise + np.log(2.0))
    starts, found = np.zeros((count, 6)), 0
    B, gate = tangent_basis(t), 4.0 * likelihood.noise * np.exp(log_noise)
    for k in np.argsort(unlikely)[: 2 * count]:
        residuals = sampson_residuals(matrices[k], likelihood.m_star, likelihood.m)
        near = np.flatnonzero(np.abs(residuals) < gate)
        if found == count or len(near) < 6:
            continue
        m_star, m = likelihood.m_star[near], likelihood.m[near]
        R_k, t_k, _ = choose_motion(matrices[k], m_star, m)
        R_k, t_k, _ = refine_essential(R_k, t_k, m_star, m, 6)
        ahead = dot(t_k, t)
        if ahead > _AHEAD:
            starts[found, :3] = so3_log(times(R_k, R.T.copy()))
            starts[found, 3:5] = transposed_apply(B, t_k) / ahead
            found += 1
    return starts[:found]


@njit(cache=True)
def draw_motions(
    likelihood: Likelihood,
    R: FloatArray,
    t: FloatArray,
    log_noise: float,
    starts: FloatArray,
    draws: Draws,
) -> tuple[FloatArray, FloatArray]:
    """Sample motions by a differential-evolution Markov chain [TerBraak2006].

    Args:
        likelihood: of the matches.
        R: of the best motion, (3, 3).
        t: of the best motion, unit, (3,).
        log_noise: of the noise over the stated one; sampled as well if there are many matches.
        starts: initial walkers, (S, 6); the others start near the best motion.
        draws: random numbers.

    Returns:
        (ω, τ, log noise) of the samples, (M, 6), and −2 log of their likelihoods, (M,).
    """
    rounds, walkers = draws.threshold.shape
    J = sampson_jacobian(R, t, likelihood.m_star, likelihood.m)
    deviation = likelihood.noise * np.exp(log_noise)
    values, vectors = symmetric_eigen(transposed_times(J, J) / deviation**2)
    spread = np.zeros((6, 6))
    for k in range(5):
        spread[:5, k] = vectors[:, k] / np.sqrt(max(values[k], 1.0))
    if len(likelihood.m) >= _MANY:
        spread[5, 5] = 0.5 / np.sqrt(len(likelihood.m))
    x, unlikely = np.zeros((walkers, 6)), np.empty(walkers)
    samples = np.empty(((rounds - _SETTLING) * walkers, 6))
    values = np.empty(len(samples))
    x[:, 5] = log_noise
    x[: len(starts), :5] = starts[:, :5]
    for i in range(walkers):
        x[i] += apply(spread, draws.jitter[0, i])
        x[i, 5] = min(max(x[i, 5], 0.0), _NOISIER)
        R_i, t_i = motion_at(R, t, x[i])
        unlikely[i] = unlikelihood(likelihood, times(skew(t_i), R_i), x[i, 5])
    for g in range(rounds):
        for i in range(walkers):
            step = x[draws.partners[g, i, 0]] - x[draws.partners[g, i, 1]]
            trial = x[i] + draws.length[g, i] * step + 0.05 * apply(spread, draws.jitter[g, i])
            if 0.0 <= trial[5] <= _NOISIER:
                R_i, t_i = motion_at(R, t, trial)
                value = unlikelihood(likelihood, times(skew(t_i), R_i), trial[5])
                if value - unlikely[i] < TEMPERATURE * draws.threshold[g, i]:
                    x[i], unlikely[i] = trial, value
            if g >= _SETTLING:
                at = (g - _SETTLING) * walkers + i
                samples[at], values[at] = x[i], unlikely[i]
    return samples, values


@njit(cache=True)
def spread_of_motions(
    R: FloatArray,
    t: FloatArray,
    samples: FloatArray,
    unlikely: FloatArray,
    m_star: FloatArray,
    m: FloatArray,
    noise: FloatArray,
) -> tuple[FloatArray, int]:
    """Return the covariance of Υ about a motion, (6, 6), and the number of samples used.

    It is the second moment of the samples, widened to contain each of them.

    Args:
        R: of the motion, (3, 3).
        t: of the motion, unit, (3,).
        samples: (ω, τ, …) about it, (M, 6).
        unlikely: −2 log of their likelihoods, (M,).
        m_star: points of the reference plane in the desired view, normalized, (K, 2).
        m: the same points in the current view, (K, 2).
        noise: of their coordinates in both views, (M, K, 4).
    """
    t_d, behind = translation_over_distance(R, t, m_star, m)
    differences, above = np.empty((len(samples), 6)), np.empty(len(samples))
    moments, total, count = np.zeros((1, 6, 6)), 0.0, 0
    if behind:
        return moments[0], 0
    upsilon = np.concatenate((t_d, so3_log(R.T.copy())))
    for s in range(len(samples)):
        R_s, t_s = motion_at(R, t, samples[s])
        t_d, behind = translation_over_distance(R_s, t_s, m_star, m)
        t_noisy, noisy_behind = translation_over_distance(
            R_s, t_s, m_star + noise[s, :, :2], m + noise[s, :, 2:]
        )
        if behind or noisy_behind:
            continue
        difference = upsilon_between(upsilon, R_s.T.copy(), t_d)
        differences[count], above[count] = difference, unlikely[s] - unlikely.min()
        difference[:3] += t_noisy - t_d
        weight = np.exp(-0.5 * above[count] * (1.0 - 1.0 / TEMPERATURE))
        for i in range(6):
            for j in range(6):
                moments[0, i, j] += weight * difference[i] * difference[j]
        total += weight
        count += 1
    moments /= max(total, 1e-300)
    if count >= _FEWEST:
        for s in range(count):
            widen(moments, differences[s].copy().reshape(1, 6), max(_ASIDE * above[s], _LEAST))
    return moments[0], count


def covariance_of_likely(
    likelihood: Likelihood,
    R: FloatArray,
    t: FloatArray,
    scale: float,
    m_star: FloatArray,
    m: FloatArray,
) -> FloatArray | None:
    """Return the covariance of Υ over the likely motions about the best one, (6, 6).

    Args:
        likelihood: of all matches.
        R: of the best motion, (3, 3).
        t: of the best motion, unit, (3,).
        scale: variance of the noise over the stated one.
        m_star: points of the reference plane in the desired view, normalized, (K, 2).
        m: the same points in the current view, (K, 2).

    Returns:
        The covariance, or None if the reference plane lies behind a camera for most of them.
    """
    log_noise = min(0.5 * float(np.log(scale)), float(_NOISIER))
    matrices = sampled_motions(likelihood.m_star, likelihood.m)
    starts = starting_walkers(likelihood, R, t, log_noise, matrices, _STARTS)
    samples, unlikely = draw_motions(likelihood, R, t, log_noise, starts, _DRAWS)
    random = np.random.default_rng(0)
    deviation = likelihood.noise * np.exp(log_noise)
    noise = deviation * random.normal(size=(len(samples), len(m), 4))
    covariance, count = spread_of_motions(R, t, samples, unlikely, m_star, m, noise)
    return covariance if count >= _FEWEST else None


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
    inverse, _ = inverse_depths(R, t, m_star, m)
    if inverse.min() <= _FARTHEST:
        return np.zeros(3), True
    points = homogeneous(m_star)
    for k in range(len(points)):
        points[k] /= inverse[k]
    N = reference_plane(points)
    return -np.sqrt(dot(N, N)) * transposed_apply(R, t), False
