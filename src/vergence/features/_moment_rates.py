"""How moments, and the features derived from them, change as points or corners move.

Rates are those of K motions at once: a column for each, such as the camera's six unit twists.
"""

from typing import NamedTuple

import numpy as np

from vergence.arrays import FloatArray
from vergence.features._moments import ORDER, CentralMoments, axes, up_to_order

# Gauss's rule on a side, from 0 to 1: exact for the polynomials here, of fifth degree at most.
_ALONG = 0.5 + np.array([-0.5, 0.0, 0.5]) * np.sqrt(0.6)
_WEIGHTS = np.array([5.0, 8.0, 5.0]) / 18.0


class MomentRates(NamedTuple):
    """The derivative of `CentralMoments` by time."""

    centre: FloatArray  # (2, K)
    size: FloatArray  # (K,)
    mu: FloatArray  # (4, 4, K); zero where p + q > 3


def rates_of_points(points: FloatArray, flows: FloatArray, now: CentralMoments) -> MomentRates:
    """Return the rates of the moments of discrete points.

    Args:
        points: (M, 2).
        flows: their velocities, (M, 2, K).
        now: their moments.
    """
    centre = flows.mean(axis=0)
    own = flows - centre
    powers = (points - now.centre)[:, :, None] ** np.arange(ORDER + 1)
    slopes = np.arange(ORDER + 1) * np.roll(powers, 1, axis=2)  # p xᵖ⁻¹; 0 for p = 0
    mu = np.einsum("mp,mq,mk->pqk", slopes[:, 0], powers[:, 1], own[:, 0])
    mu += np.einsum("mp,mq,mk->pqk", powers[:, 0], slopes[:, 1], own[:, 1])
    mu = up_to_order(mu)
    return MomentRates(centre, mu[2, 0] + mu[0, 2], mu)


def rates_of_polygon(corners: FloatArray, flows: FloatArray, now: CentralMoments) -> MomentRates:
    """Return the rates of the moments of a polygon's interior.

    ṁ_pq = ∮ x^p y^q (velocity · outward normal), about a fixed point [Chaumette2004]; along a side
    the velocity is linear between those of its ends.

    Args:
        corners: in order, (M, 2).
        flows: their velocities, (M, 2, K).
        now: their moments.
    """
    at = corners - now.centre
    side, change = np.roll(at, -1, axis=0) - at, np.roll(flows, -1, axis=0) - flows
    points = at[:, None] + _ALONG[:, None] * side[:, None]  # (M, 3, 2)
    moving = flows[:, None] + _ALONG[:, None, None] * change[:, None]  # (M, 3, 2, K)
    outward = moving[:, :, 0] * side[:, None, 1, None] - moving[:, :, 1] * side[:, None, 0, None]
    powers = points[..., None] ** np.arange(ORDER + 1)
    swept = _WEIGHTS[:, None] * outward
    raw = np.einsum("mgp,mgq,mgk->pqk", powers[:, :, 0], powers[:, :, 1], swept)
    twice_area = np.sum(at[:, 0] * np.roll(at[:, 1], -1) - at[:, 1] * np.roll(at[:, 0], -1))
    raw *= np.sign(twice_area)  # corners may be in either order
    centre = np.array([raw[1, 0], raw[0, 1]]) / now.size
    mu = raw - _slopes(now.mu)[..., None] * centre[0]
    mu -= _slopes(now.mu.T).T[..., None] * centre[1]
    return MomentRates(centre, raw[0, 0], up_to_order(mu))


def orientation_rate(mu: FloatArray, rates: FloatArray) -> FloatArray:
    """Return the rate of the direction α of the longest extent, (K,).

    Args:
        mu: central moments, (4, 4).
        rates: of those, (4, 4, K); likewise below.
    """
    (across, along), (by_across, by_along) = axes(mu), axes(rates)
    rate: FloatArray = 0.5 * (along * by_across - across * by_along) / (across**2 + along**2)
    return rate


def elongation_rate(mu: FloatArray, rates: FloatArray) -> FloatArray:
    """Return the rate of ε, (K,)."""
    (across, along), (by_across, by_along) = axes(mu), axes(rates)
    total, apart = mu[2, 0] + mu[0, 2], np.hypot(across, along)
    by_apart = (across * by_across + along * by_along) / apart
    rate: FloatArray = by_apart / total - apart / total**2 * (rates[2, 0] + rates[0, 2])
    return rate


def tilt_rates(now: CentralMoments, tilt: FloatArray, rates: MomentRates) -> FloatArray:
    """Return the rates of s_x and s_y, (2, K).

    Args:
        now: the moments.
        tilt: s_x and s_y, (2,).
        rates: of the moments.
    """
    mu, by = now.mu, rates.mu
    (s1, c1), (by_s1, by_c1) = axes(mu), axes(by)
    c2, s2 = mu[0, 3] - 3.0 * mu[2, 1], mu[3, 0] - 3.0 * mu[1, 2]
    by_c2, by_s2 = by[0, 3] - 3.0 * by[2, 1], by[3, 0] - 3.0 * by[1, 2]
    c3, s3 = c1 * c1 - s1 * s1, 2.0 * s1 * c1
    by_c3, by_s3 = 2.0 * (c1 * by_c1 - s1 * by_s1), 2.0 * (s1 * by_c1 + c1 * by_s1)
    square, total = c1 * c1 + s1 * s1, mu[2, 0] + mu[0, 2]
    scale, by_scale = square * total**1.5, 2.0 * (c1 * by_c1 + s1 * by_s1) / square
    by_scale += 1.5 * (by[2, 0] + by[0, 2]) / total  # relative to the scale
    if now.dense:
        scale /= np.sqrt(now.size)
        by_scale -= 0.5 * rates.size / now.size
    first = by_c2 * c3 + c2 * by_c3 + by_s2 * s3 + s2 * by_s3
    second = by_s2 * c3 + s2 * by_c3 - by_c2 * s3 - c2 * by_s3
    changed: FloatArray = np.array([first, second]) / scale - tilt[:, None] * by_scale
    return changed


def _slopes(mu: FloatArray) -> FloatArray:
    """Return p μ_{p-1,q}, (4, 4): by how much a shift along x changes each moment."""
    slopes: FloatArray = np.arange(ORDER + 1)[:, None] * np.roll(mu, 1, axis=0)
    return slopes
