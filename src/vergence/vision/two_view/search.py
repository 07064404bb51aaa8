"""Motions tried: from every linear route without wrong matches, from random samples with them."""

from itertools import combinations
from math import comb, log

import numpy as np
from numba import njit

from vergence.arrays import BoolArray, FloatArray, IntArray
from vergence.geometry import skew
from vergence.vision.two_view.checks import widest_triples
from vergence.vision.two_view.decomposition import (
    decompose_essential,
    decompose_homography,
    inverse_depths,
    nearest_rotation,
)
from vergence.vision.two_view.linear import homogeneous, linear_essential, linear_homography
from vergence.vision.two_view.sampson import refine_essential, sampson_residuals
from vergence.vision.two_view.small import dot, inverse3, times, transposed_times, unit

SAMPLES = 400  # most random samples of matches that are tried
CONFIDENCE = 0.999  # with which one of the samples should be free of wrong matches


@njit(cache=True)
def rotation_between(m_star: FloatArray, m: FloatArray) -> FloatArray:
    """Return the rotation R that best turns the desired rays into the current ones."""
    a, b = homogeneous(m_star), homogeneous(m)
    for j in range(len(a)):
        a[j], b[j] = unit(a[j]), unit(b[j])
    return nearest_rotation(transposed_times(b, a))


@njit(cache=True)
def choose_motion(
    E: FloatArray, m_star: FloatArray, m: FloatArray
) -> tuple[FloatArray, FloatArray, int]:
    """Return the motion (R, t) of E that puts most points before both cameras, and their number."""
    rotations, translations = decompose_essential(E)
    best, most = 0, -1
    for k in range(4):
        _, front = inverse_depths(rotations[k], translations[k], m_star, m)
        if front > most:
            best, most = k, front
    return rotations[best], translations[best], most


@njit(cache=True)
def fit_general(
    m_star: FloatArray, m: FloatArray, guesses: int, penalty: float
) -> tuple[FloatArray, FloatArray, float]:
    """Return the motion of an object of any shape: linear guesses, each refined, the best kept.

    The linear solution depends on the reference triple and is fragile, so several are tried, and
    the two motions of the best common plane as well (an object may be nearly flat).

    Args:
        m_star: points in the desired view, normalized, (N, 2), N ≥ 8.
        m: the same points in the current view, (N, 2).
        guesses: how many reference triples to try.
        penalty: what a point behind a camera adds to the cost.

    Returns:
        R (3, 3), unit t (3,) and the cost: squared Sampson distances plus penalties.
    """
    triples = widest_triples(m_star, m, guesses)
    plane_R, plane_t, _ = decompose_homography(linear_homography(m_star, m))
    best_R, best_t, best_cost = plane_R[0], np.array([0.0, 0.0, 1.0]), np.inf
    for k in range(guesses + 2):
        if k < guesses:
            if triples[k, 0] == triples[k, 1]:
                continue
            E = linear_essential(m_star, m, triples[k])
        else:
            E = times(skew(plane_t[k - guesses]), plane_R[k - guesses])
        if not np.isfinite(E).all() or np.linalg.norm(E) < 1e-9:
            continue
        R, t, _ = choose_motion(E, m_star, m)
        R, t, cost = refine_essential(R, t, m_star, m, 15)
        R, t, front = choose_motion(times(skew(t), R), m_star, m)
        cost += penalty * (len(m) - front)
        if cost < best_cost:
            best_R, best_t, best_cost = R, t, cost
    return best_R, best_t, best_cost


@njit(cache=True)
def epipolar_errors(R: FloatArray, t: FloatArray, m_star: FloatArray, m: FloatArray) -> FloatArray:
    """Return the squared Sampson distance of each match, infinite behind a camera."""
    errors = sampson_residuals(times(skew(t), R), m_star, m) ** 2
    w, _ = inverse_depths(R, t, m_star, m)
    for j in range(len(m)):
        a = np.array([m_star[j, 0], m_star[j, 1], 1.0])
        if w[j] <= 0.0 or dot(R[2], a) + w[j] * t[2] <= 0.0:
            errors[j] = np.inf
    return errors


@njit(cache=True)
def transfer_errors(H: FloatArray, m_star: FloatArray, m: FloatArray) -> FloatArray:
    """Return the squared distance of each match from m ~ H m*, the mean of both directions."""
    forward, back = times(homogeneous(m_star), H.T), times(homogeneous(m), inverse3(H).T)
    errors = np.empty(len(m))
    for j in range(len(m)):
        if forward[j, 2] <= 0.0:
            errors[j] = np.inf
            continue
        there = forward[j, :2] / forward[j, 2] - m[j]
        here = back[j, :2] / back[j, 2] - m_star[j]
        errors[j] = 0.25 * (dot(there, there) + dot(here, here))
    return errors


@njit(cache=True)
def sample_errors(
    general: bool, sample: IntArray, m_star: FloatArray, m: FloatArray, gate: float
) -> FloatArray:
    """Return every match's error under the model of one sample, refitted twice to its inliers."""
    chosen = sample
    errors = np.full(len(m), np.inf)
    for _ in range(3):
        if general:
            R, t, _ = fit_general(m_star[chosen], m[chosen], 2, gate)
            errors = epipolar_errors(R, t, m_star, m)
        else:
            errors = transfer_errors(linear_homography(m_star[chosen], m[chosen]), m_star, m)
        inliers = np.flatnonzero(errors < gate)
        if len(inliers) <= len(sample):
            break
        chosen = inliers
    return errors


def find_inliers(general: bool, m_star: FloatArray, m: FloatArray, gate: float) -> BoolArray:
    """Return which matches agree on one motion, (N,): random samples, scored by truncated errors.

    The samples come from a fixed seed, and all of them are tried where there are few, so that the
    same matches always give the same answer.

    Args:
        general: an object of any shape from samples of eight, or a plane from samples of four.
        m_star: points in the desired view, normalized, (N, 2).
        m: the same points in the current view, (N, 2).
        gate: squared error above which a match is wrong.
    """
    size = 8 if general else 4
    best_score, best = np.inf, np.zeros(len(m), dtype=np.bool_)
    needed = float(SAMPLES)
    for tried, sample in enumerate(_samples(len(m), size)):
        if tried >= needed:
            break
        errors = sample_errors(general, sample, m_star, m, gate)
        score = float(np.minimum(errors, gate).sum())
        if score < best_score:
            best_score, best = score, errors < gate
            clean = float(best.mean()) ** size
            if clean > 0.0:
                needed = log(1 - CONFIDENCE) / log(1 - clean) if clean < 1.0 else 0.0
    return best


def _samples(count: int, size: int) -> IntArray:
    if comb(count, size) <= SAMPLES:
        return np.array(list(combinations(range(count), size)), dtype=np.int64)
    random = np.random.default_rng(0)
    return np.array([random.permutation(count)[:size] for _ in range(SAMPLES)], dtype=np.int64)
