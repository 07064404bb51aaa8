"""Tests whether so many matches could agree so well by chance.

An a-contrario test: if the matches were wrong, their points would lie anywhere in the region that
the matches cover. The number of false alarms (NFA) is how many of all tried models would then be
expected to fit k of n matches as well as the present one does [Moisan2004]. The threshold for
agreement is the one that minimises the NFA, so it adapts to the noise.
"""

from math import lgamma, log, pi

import numpy as np
from numba import njit

from vergence.arrays import FloatArray

CHANCE = -3.0  # log₁₀ of the NFA above which an agreement is attributed to chance


@njit(cache=True)
def log_choices(count: int, chosen: int) -> float:
    """Return the natural logarithm of the binomial coefficient."""
    return lgamma(count + 1.0) - lgamma(chosen + 1.0) - lgamma(count - chosen + 1.0)


@njit(cache=True)
def least_false_alarms(
    errors: FloatArray,
    sample: int,
    outcomes: int,
    power: int,
    log_density: float,
    floor: float,
    ceiling: float,
) -> tuple[float, float]:
    """Return log₁₀ NFA at the best threshold, and that threshold; infinite and 0 if none.

    NFA(k) = outcomes (n - s) C(n, k) C(k, s) (density e_k^power)^(k - s).

    Args:
        errors: of each match under the model, (N,), normalized coordinates.
        sample: s, number of matches that determine a model.
        outcomes: largest number of models per sample.
        power: 2 if a point must lie in a disc of radius e, 1 if in a band of half width e.
        log_density: natural logarithm of the probability of a random point at e = 1.
        floor: smallest threshold, since errors are not known better.
        ceiling: largest threshold.
    """
    count, least, threshold = len(errors), np.inf, 0.0
    ordered = np.sort(errors)
    for k in range(sample + 1, count + 1):
        error = max(ordered[k - 1], floor)
        if not error <= ceiling:
            break
        chance = min(0.0, power * log(error) + log_density)
        alarms = log(outcomes * (count - sample)) + log_choices(count, k) + log_choices(k, sample)
        alarms += (k - sample) * chance
        if alarms < least:
            least, threshold = alarms, error
    return least / log(10.0), threshold


@njit(cache=True)
def log_densities(m_star: FloatArray, m: FloatArray) -> tuple[float, float]:
    """Return the log-probabilities of a point in a disc, π e²/A, and in a band, 2 D e/A, at e = 1.

    A and D are area and diagonal of the bounding box of the matches, in the view where it is
    smaller: crowded matches prove less than matches spread over the image.
    """
    disc, band = -np.inf, -np.inf
    for points in (m_star, m):
        width = points[:, 0].max() - points[:, 0].min()
        height = points[:, 1].max() - points[:, 1].min()
        area = max(width * height, 1e-12)
        disc = max(disc, log(pi / area))
        band = max(band, log(2.0 * np.hypot(width, height) / area))
    return disc, band


@njit(cache=True)
def log_chance_of_plane(count: int, flat: int, error: float, parallax: float) -> float:
    """Return log₁₀ of the NFA of a plane among the points of an object that is not flat.

    Three points define a plane; each other point of a rigid object lies anywhere along its epipolar
    line, within the parallax of the relief: (n - 3) C(n, k) (2 e / parallax)^(k - 3).

    Args:
        count: n, number of matches.
        flat: k, number of them on the plane.
        error: e, their largest error.
        parallax: displacement of a point by the relief.
    """
    if flat < 4 or not parallax > 0.0:
        return np.inf
    chance = min(0.0, log(2.0 * error / parallax))
    alarms = log(max(count - 3.0, 1.0)) + log_choices(count, flat) + (flat - 3) * chance
    return alarms / log(10.0)
