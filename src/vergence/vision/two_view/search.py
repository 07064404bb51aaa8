"""Models that many matches agree on, found by random samples and tested against chance."""

from itertools import combinations
from math import comb
from typing import NamedTuple

import numpy as np
from numba import njit

from vergence.arrays import BoolArray, FloatArray, IntArray
from vergence.vision.two_view.evidence import least_false_alarms, log_densities
from vergence.vision.two_view.five_point import five_point_matrices
from vergence.vision.two_view.linear import homogeneous, linear_homography
from vergence.vision.two_view.motions import choose_motion, essential
from vergence.vision.two_view.sampson import refine_essential
from vergence.vision.two_view.small import apply, inverse3, times, transposed_apply

PLANE_SAMPLES = 400  # largest number of samples of four matches
MOTION_SAMPLES = 150  # largest number of samples of five
_FLOOR = 1.0  # smallest threshold, standard deviations of the stated noise
_MANY = 16  # matches from which the noise can be estimated


class Agreement(NamedTuple):
    """The matches that agree on one model."""

    log_alarms: float  # log₁₀ of the number of false alarms
    error: float  # largest error of an agreeing match, normalized coordinates
    kept: BoolArray  # (N,)
    errors: FloatArray  # (N,) of all matches, normalized coordinates

    @property
    def size(self) -> int:
        """Number of agreeing matches."""
        return int(np.count_nonzero(self.kept))


def ceiling(count: int) -> float:
    """Return the largest threshold, in standard deviations of the stated noise.

    It is three deviations of noise up to four times as large as stated, or up to twice as large
    with few matches.
    """
    return 12.0 if count >= _MANY else 6.0


def find_plane(m_star: FloatArray, m: FloatArray, noise: float) -> Agreement:
    """Return the matches that agree on one homography, from samples of four.

    Args:
        m_star: points in the desired view, normalized, (N, 2), N ≥ 5.
        m: the same points in the current view, (N, 2).
        noise: stated standard deviation of a normalized coordinate.
    """
    samples = _samples(len(m), 4, PLANE_SAMPLES)
    disc, _ = log_densities(m_star, m)
    return _agreement(
        *_best_plane(samples, m_star, m, disc, _FLOOR * noise, ceiling(len(m)) * noise)
    )


def find_motion(m_star: FloatArray, m: FloatArray, noise: float, matrices: FloatArray) -> Agreement:
    """Return the matches that agree on one motion of an object of any shape.

    Args:
        m_star: points in the desired view, normalized, (N, 2), N ≥ 8.
        m: the same points in the current view, (N, 2).
        noise: stated standard deviation of a normalized coordinate.
        matrices: `sampled_motions` of the points, (K, 3, 3).
    """
    _, band = log_densities(m_star, m)
    return _agreement(
        *_best_motion(matrices, m_star, m, band, _FLOOR * noise, ceiling(len(m)) * noise)
    )


def sampled_motions(m_star: FloatArray, m: FloatArray) -> FloatArray:
    """Return the essential matrices of samples of five matches, (K, 3, 3)."""
    return five_point_matrices(_samples(len(m), 5, MOTION_SAMPLES), m_star, m)


def _agreement(log_alarms: float, error: float, errors: FloatArray) -> Agreement:
    return Agreement(log_alarms, error, errors <= error, errors)


def _samples(count: int, size: int, most: int) -> IntArray:
    """Return samples of matches, (S, size): all if there are few, else the same for equal counts.

    Half of them come from the better half of the matches, since the best come first.
    """
    if comb(count, size) <= most:
        return np.array(list(combinations(range(count), size)), dtype=np.int64)
    random = np.random.default_rng(0)
    halves = (max(count // 2, size + 1), count)
    return np.array(
        [random.permutation(min(halves[k % 2], count))[:size] for k in range(most)], dtype=np.int64
    )


@njit(cache=True)
def transfer_errors(H: FloatArray, m_star: FloatArray, m: FloatArray) -> FloatArray:
    """Return the distance of each match from m ~ H m*, the larger of both directions, (N,)."""
    forward, back = times(homogeneous(m_star), H.T), times(homogeneous(m), inverse3(H).T)
    errors = np.full(len(m), np.inf)
    for j in range(len(m)):
        if forward[j, 2] > 0.0 and back[j, 2] > 0.0:
            there = forward[j, :2] / forward[j, 2] - m[j]
            here = back[j, :2] / back[j, 2] - m_star[j]
            square = max(there[0] ** 2 + there[1] ** 2, here[0] ** 2 + here[1] ** 2)
            errors[j] = np.sqrt(square)
    return errors


@njit(cache=True)
def epipolar_errors(E: FloatArray, m_star: FloatArray, m: FloatArray) -> FloatArray:
    """Return the distance of each match from its epipolar line, the larger of both views, (N,)."""
    errors = np.empty(len(m))
    for j in range(len(m)):
        a = np.array([m_star[j, 0], m_star[j, 1], 1.0])
        b = np.array([m[j, 0], m[j, 1], 1.0])
        line, line_star = apply(E, a), transposed_apply(E, b)
        miss = abs(line[0] * b[0] + line[1] * b[1] + line[2])
        smaller = min(np.hypot(line[0], line[1]), np.hypot(line_star[0], line_star[1]))
        errors[j] = miss / max(smaller, 1e-150)
    return errors


@njit(cache=True)
def _best_plane(
    samples: IntArray,
    m_star: FloatArray,
    m: FloatArray,
    density: float,
    floor: float,
    ceiling: float,
) -> tuple[float, float, FloatArray]:
    """Return log₁₀ NFA, threshold and errors (N,) of the homography least likely by chance."""
    least, threshold, errors = np.inf, 0.0, np.full(len(m), np.inf)
    for sample in samples:
        chosen = sample
        for _ in range(3):  # from the sample, then twice from all that agree
            H = linear_homography(m_star[chosen], m[chosen])
            tried = transfer_errors(H, m_star, m)
            alarms, gate = least_false_alarms(tried, 4, 1, 2, density, floor, ceiling)
            if not alarms < least:
                break
            least, threshold, errors = alarms, gate, tried
            chosen = np.flatnonzero(tried <= gate)
    return least, threshold, errors


@njit(cache=True)
def _best_motion(
    matrices: FloatArray,
    m_star: FloatArray,
    m: FloatArray,
    density: float,
    floor: float,
    ceiling: float,
) -> tuple[float, float, FloatArray]:
    """Return log₁₀ NFA, threshold and errors (N,) of the motion least likely by chance."""
    least, threshold, errors = np.inf, 0.0, np.full(len(m), np.inf)
    for k in range(len(matrices)):
        E = matrices[k]
        for _ in range(3):  # as found, then twice refined on all that agree
            tried = epipolar_errors(E, m_star, m)
            alarms, gate = least_false_alarms(tried, 5, 10, 1, density, floor, ceiling)
            if not alarms < least:
                break
            least, threshold, errors = alarms, gate, tried
            chosen = np.flatnonzero(tried <= gate)
            R, t, _ = choose_motion(E, m_star[chosen], m[chosen])
            R, t, _ = refine_essential(R, t, m_star[chosen], m[chosen], 10)
            E = essential(R, t)
    return least, threshold, errors
