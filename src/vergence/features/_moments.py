"""Moments of points and of polygons, and the features derived from them [Tahri2005]."""

from math import comb
from typing import NamedTuple

import numpy as np

from vergence.arrays import FloatArray
from vergence.errors import InputError

ORDER = 3
# Terms of the integrals over a polygon: p, q, and the powers of a side's end point.
_P, _Q, _K, _J = np.array(
    [
        (p, q, k, j)
        for p in range(ORDER + 1)
        for q in range(ORDER + 1 - p)
        for k in range(p + 1)
        for j in range(q + 1)
    ]
).T


def _factors() -> FloatArray:
    """Return the factor of each term in each integral, (16, terms)."""
    factors = np.zeros(((ORDER + 1) ** 2, len(_P)))
    for term, (p, q, k, j) in enumerate(
        zip(*map(np.ndarray.tolist, (_P, _Q, _K, _J)), strict=True)
    ):
        share = (p + q + 2) * (p + q + 1) * comb(p + q, p)
        ways = comb(k + j, j) * comb(p + q - k - j, q - j)
        factors[(ORDER + 1) * p + q, term] = ways / share
    return factors


_FACTORS = _factors()
_ROUND = 1e-9  # relative to the spread: closer extents are equal, so orientation is undefined


class CentralMoments(NamedTuple):
    """Moments up to third order about the centre of a set of points or of a polygon.

    Attributes:
        centre: (2,).
        size: grows with the square of the image size: a polygon's area, or the sum of squared
            distances of the points from their centre.
        mu: μ_pq, (4, 4); zero where p + q > 3.
        dense: true for the interior of a polygon, false for discrete points.
    """

    centre: FloatArray
    size: float
    mu: FloatArray
    dense: bool


def moments_of_points(name: str, points: FloatArray) -> CentralMoments:
    """Return the moments of discrete points, (M, 2).

    Raises:
        InputError: if all points coincide.
    """
    centre = points.mean(axis=0)
    powers = (points - centre)[:, :, None] ** np.arange(ORDER + 1)
    mu = up_to_order(np.einsum("mp,mq->pq", powers[:, 0], powers[:, 1]))
    size = float(mu[2, 0] + mu[0, 2])
    if not size > 0.0:
        raise InputError(name, "points", "points that all coincide", "distinct points")
    return CentralMoments(centre, size, mu, dense=False)


def require_same_points(name: str, points: FloatArray, desired: FloatArray) -> None:
    """Refuse sizes of different numbers of points, which are sums over them.

    Raises:
        InputError: if there are not as many desired points.
    """
    if len(points) != len(desired):
        raise InputError(name, "desired", f"{len(desired)} points", f"{len(points)}, as here")


def moments_of_polygon(name: str, corners: FloatArray) -> CentralMoments:
    """Return the moments of the interior of a polygon, from its corners in order, (M, 2).

    Integrals over the interior are sums over the sides, by Green's theorem [Steger1996].

    Raises:
        InputError: if the polygon has no area, or crosses itself so that its second moments vanish.
    """
    about = corners.mean(axis=0)
    raw = _polygon_integrals(corners - about)
    if not abs(raw[0, 0]) > 0.0 or len(corners) < 3:
        raise InputError(name, "points", "corners that enclose no area", "corners of a polygon")
    middle = np.array([raw[1, 0], raw[0, 1]]) / raw[0, 0]
    mu = _polygon_integrals(corners - about - middle)
    mu *= np.sign(raw[0, 0])  # corners may be in either order
    if not (mu[2, 0] > 0.0 and mu[2, 0] * mu[0, 2] > mu[1, 1] ** 2):
        raise InputError(name, "points", "a polygon that crosses itself", "corners in order")
    return CentralMoments(about + middle, float(mu[0, 0]), mu, dense=True)


def axes(mu: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return 2 μ11 and μ20 - μ02, of moments or of their rates, (4, 4, …)."""
    return 2.0 * mu[1, 1], mu[2, 0] - mu[0, 2]


def orientation(name: str, mu: FloatArray) -> float:
    """Return the direction α of the longest extent, rad in (-π/2, π/2].

    Raises:
        InputError: if the extent is the same in all directions.
    """
    across, along = axes(mu)
    if np.hypot(across, along) <= _ROUND * (mu[2, 0] + mu[0, 2]):
        raise InputError(name, "points", "extents that are alike", "a set with a longest extent")
    return float(0.5 * np.arctan2(across, along))


def elongation(mu: FloatArray) -> float:
    """Return ε = √φ2 / φ1, with the invariants φ of [Hu1962]: 0 for like extents, 1 for a line.

    It is invariant to translation, scale and rotation in the image. An oblique view shortens one
    extent, and changes it the more the more oblique the view is.
    """
    across, along = axes(mu)
    return float(np.hypot(across, along) / (mu[2, 0] + mu[0, 2]))


def tilt_invariants(moments: CentralMoments) -> FloatArray:
    """Return s_x and s_y, (2,), [Tahri2005].

    They are invariant to translation, scale and rotation in the image; they change when the camera
    rotates about its x or y axis.
    """
    mu = moments.mu
    s1, c1 = axes(mu)
    c2, s2 = mu[0, 3] - 3.0 * mu[2, 1], mu[3, 0] - 3.0 * mu[1, 2]
    c3, s3 = c1 * c1 - s1 * s1, 2.0 * s1 * c1
    scale = (c1 * c1 + s1 * s1) * (mu[2, 0] + mu[0, 2]) ** 1.5
    if moments.dense:
        scale /= np.sqrt(moments.size)
    invariants: FloatArray = np.array([c2 * c3 + s2 * s3, s2 * c3 - c2 * s3]) / scale
    return invariants


def _polygon_integrals(corners: FloatArray) -> FloatArray:
    """Return ∫ x^p y^q over the interior of a polygon, signed by its orientation, (4, 4)."""
    before = np.concatenate((corners[-1:], corners[:-1]))
    twice = before[:, 0] * corners[:, 1] - corners[:, 0] * before[:, 1]
    now = corners[:, :, None] ** np.arange(ORDER + 1)
    last = before[:, :, None] ** np.arange(ORDER + 1)
    terms = now[:, 0, _K] * last[:, 0, _P - _K] * now[:, 1, _J] * last[:, 1, _Q - _J]
    integrals: FloatArray = (_FACTORS @ (twice @ terms)).reshape(ORDER + 1, ORDER + 1)
    return integrals


def up_to_order(mu: FloatArray) -> FloatArray:
    """Return moments or their rates, (4, 4, …), with zeros where p + q > 3."""
    p = np.arange(ORDER + 1)
    kept = p[:, None] + p <= ORDER
    return np.where(kept.reshape(kept.shape + (1,) * (mu.ndim - 2)), mu, 0.0)
