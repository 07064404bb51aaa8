"""All motions at which the epipolar error of matched points has a local minimum.

With little parallax, few points or a nearly flat object, the error has several minima, some of
which the noise cannot distinguish. The descents therefore start from motions spread over rotations
and directions of translation, and from those of linear fits.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from vergence.arrays import FloatArray
from vergence.geometry import nearest_rotation, skew
from vergence.vision.two_view.checks import widest_triples
from vergence.vision.two_view.decomposition import (
    decompose_essential,
    decompose_homography,
    inverse_depths,
)
from vergence.vision.two_view.linear import homogeneous, linear_essential, linear_homography
from vergence.vision.two_view.sampson import refine_essential
from vergence.vision.two_view.small import dot, times, transposed_times, unit

TURNED = 0.02  # rad, difference of rotation that makes two motions distinct
AIMED = 0.1  # rad, and of their directions of translation
_POINTS = 24  # largest number of points for the first descents
_DIRECTIONS = np.array(
    [
        *((1, 0, 0), (0, 1, 0), (0, 0, 1)),
        *((1, 1, 0), (1, -1, 0), (1, 0, 1), (1, 0, -1), (0, 1, 1), (0, 1, -1)),
        *((1, 1, 1), (1, 1, -1), (1, -1, 1), (-1, 1, 1)),
    ],
    dtype=np.float64,
)


class Motions(NamedTuple):
    """Motions, the best first."""

    R: FloatArray  # (K, 3, 3)
    t: FloatArray  # (K, 3), unit
    cost: FloatArray  # (K,) squared Sampson distances, and penalties for points behind a camera


@njit(cache=True)
def essential(R: FloatArray, t: FloatArray) -> FloatArray:
    """Return E = [t] R."""
    return times(skew(t), R)


@njit(cache=True)
def rotation_between(m_star: FloatArray, m: FloatArray) -> FloatArray:
    """Return the rotation R that best maps the desired rays to the current ones."""
    a, b = homogeneous(m_star), homogeneous(m)
    for j in range(len(a)):
        a[j], b[j] = unit(a[j]), unit(b[j])
    return nearest_rotation(transposed_times(b, a))


@njit(cache=True)
def choose_motion(
    E: FloatArray, m_star: FloatArray, m: FloatArray
) -> tuple[FloatArray, FloatArray, int]:
    """Return the motion (R, t) of E with most points in front of both cameras, and their number."""
    rotations, translations = decompose_essential(E)
    best, most = 0, -1
    for k in range(4):
        _, front = inverse_depths(rotations[k], translations[k], m_star, m)
        if front > most:
            best, most = k, front
    return rotations[best], translations[best], most


@njit(cache=True)
def _starts(m_star: FloatArray, m: FloatArray, triples: int) -> tuple[FloatArray, FloatArray]:
    """Return initial motions, R (S, 3, 3) and t (S, 3)."""
    plane_R, plane_t, _ = decompose_homography(linear_homography(m_star, m))
    turn = rotation_between(m_star, m)
    count = 3 * len(_DIRECTIONS) + 2 + triples
    R, t = np.empty((count, 3, 3)), np.empty((count, 3))
    at = 0
    for k in range(len(_DIRECTIONS)):
        for start in (turn, plane_R[0], plane_R[1]):
            R[at], t[at] = start, unit(_DIRECTIONS[k])
            at += 1
    for k in range(2):
        R[at], t[at] = plane_R[k], unit(plane_t[k])
        at += 1
    for triple in widest_triples(m_star, m, triples):
        E = linear_essential(m_star, m, triple) if triple[0] != triple[1] else np.zeros((3, 3))
        if np.isfinite(E).all() and np.linalg.norm(E) > 1e-9:
            R[at], t[at], _ = choose_motion(E, m_star, m)
            at += 1
    return R[:at], t[:at]


@njit(cache=True)
def _is_new(R: FloatArray, t: FloatArray, motions: Motions, count: int) -> bool:
    for k in range(count):
        trace = dot(R[0], motions.R[k, 0]) + dot(R[1], motions.R[k, 1]) + dot(R[2], motions.R[k, 2])
        turned = np.arccos(min(1.0, max(-1.0, 0.5 * (trace - 1.0))))
        aimed = np.arccos(min(1.0, max(-1.0, dot(t, motions.t[k]))))
        if turned < TURNED and aimed < AIMED:
            return False
    return True


@njit(cache=True)
def motion_minima(m_star: FloatArray, m: FloatArray, most: int, penalty: float) -> Motions:
    """Return the motions of an object of any shape that are local optima for its matches.

    Args:
        m_star: points in the desired view, normalized, (N, 2), N ≥ 8.
        m: the same points in the current view, (N, 2).
        most: largest number of motions.
        penalty: cost of a point behind a camera.
    """
    stride = max(1, len(m) // _POINTS)
    few_star, few = m_star[::stride].copy(), m[::stride].copy()
    R, t = _starts(few_star, few, 4)
    costs = np.empty(len(R))
    for k in range(len(R)):
        R[k], t[k], costs[k] = refine_essential(R[k], t[k], few_star, few, 6)
    found = Motions(np.empty((most, 3, 3)), np.empty((most, 3)), np.full(most, np.inf))
    count = 0
    for k in np.argsort(costs)[: 4 * most]:
        if count == most:
            break
        motion_R, motion_t, cost = refine_essential(R[k], t[k], m_star, m, 20)
        motion_R, motion_t, front = choose_motion(essential(motion_R, motion_t), m_star, m)
        if _is_new(motion_R, motion_t, found, count):
            found.R[count], found.t[count] = motion_R, motion_t
            found.cost[count] = cost + penalty * (len(m) - front)
            count += 1
    order = np.argsort(found.cost[:count])
    return Motions(found.R[order], found.t[order], found.cost[order])
