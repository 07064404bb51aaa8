"""The line that the samples of an edge determine, represented by two points.

A line has two parameters. They are expressed as distances across the edge at two positions, one
standard deviation of the samples to either side of their mean, where least squares makes their
errors independent. Each position is a point of the object measured well across its edge but hardly
along it, that is, a point with an elongated covariance for any filter of points.
"""

import numpy as np
from numba import njit

from vergence.arrays import BoolArray, FloatArray
from vergence.vision.known_object.edge_samples import EdgeSamples, Steps
from vergence.vision.known_object.pose_fit import PoseFit
from vergence.vision.known_object.profiles import SHARP_WIDTH
from vergence.vision.known_object.projection import pixel_rows

LEAST_SAMPLES = 4  # to determine a direction
LONG = 6  # samples from which an edge has full weight: shorter ones share their bias with others
BLUR_SHARE = 0.25  # relative to its width beyond a sharp edge's: possible error of a blurred edge
SLIDING_PX = 100.0  # standard deviation along an edge


@njit(cache=True)
def edge_points(
    fit: PoseFit,
    lens: FloatArray,
    samples: EdgeSamples,
    steps: Steps,
    found: BoolArray,
    bias_px: float,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return points (M, 3), positions (M, 2), covariances (M, 2, 2): two per edge, one if short.

    Args:
        fit: the pose fitted to the image; only the image measurement is returned, not the pose.
        lens: packed camera, (11,).
        samples: on the edges, those of each edge consecutive.
        steps: across each of them.
        found: mask of those that found their edge, (N,).
        bias_px: standard deviation of errors that do not average out over an edge: model and lens.
    """
    count = len(samples.edge)
    points = np.empty((2 * count, 3))
    places = np.empty((2 * count, 2))
    covariances = np.empty((2 * count, 2, 2))
    pixels = np.empty((count, 2))
    rows = np.empty((2, 6))
    for n in range(count):
        pixels[n, 0], pixels[n, 1], _ = pixel_rows(fit.T, lens, samples.points[n], rows)
    filled, first = 0, 0
    while first < count:
        last = first
        while last < count and samples.edge[last] == samples.edge[first]:
            last += 1
        filled += _line(
            fit,
            lens,
            samples,
            steps,
            found,
            pixels,
            first,
            last,
            bias_px,
            points[filled : filled + 2],
            places[filled : filled + 2],
            covariances[filled : filled + 2],
        )
        first = last
    return points[:filled], places[:filled], covariances[:filled]


@njit(cache=True)
def blur_error(width: float) -> float:
    """Return the standard deviation by which blur displaces an edge whose step is so wide, px."""
    error: float = BLUR_SHARE * max(width - SHARP_WIDTH, 0.0)
    return error


@njit(cache=True)
def _line(
    fit: PoseFit,
    lens: FloatArray,
    samples: EdgeSamples,
    steps: Steps,
    found: BoolArray,
    pixels: FloatArray,
    first: int,
    last: int,
    bias_px: float,
    points: FloatArray,
    places: FloatArray,
    covariances: FloatArray,
) -> int:
    """Fill the two points of one edge, samples first … last - 1; return their number."""
    nu, nv, width = 0.0, 0.0, 0.0
    n, ss, so, sss, sso, soo = 0, 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(first, last):
        nu += samples.normals[i, 0]
        nv += samples.normals[i, 1]
    norm = np.sqrt(nu * nu + nv * nv)
    nu, nv = nu / norm, nv / norm
    for i in range(first, last):
        if found[i]:
            s = nv * (pixels[i, 0] - pixels[first, 0]) - nu * (pixels[i, 1] - pixels[first, 1])
            o = fit.residuals[i]
            width += steps.widths[i, fit.chosen[i]]
            n += 1
            ss += s
            so += o
            sss += s * s
            sso += s * o
            soo += o * o
    if n == 0:
        return 0
    middle, spread = ss / n, sss - ss * ss / n
    systematic = (bias_px**2 + blur_error(width / n) ** 2) * max(1.0, LONG / n)
    if n < LEAST_SAMPLES or spread < 4.0 * n:  # too short for a direction: one position
        middle_sample = first
        for i in range(first, last):
            if found[i]:
                middle_sample = i
        points[0] = samples.points[middle_sample]
        offset = so / n
        places[0, 0] = pixels[middle_sample, 0] + offset * nu
        places[0, 1] = pixels[middle_sample, 1] + offset * nv
        _fill(covariances[0], fit.spread_px**2 / n + systematic, nu, nv)
        return 1
    slope = (sso - ss * so / n) / spread
    residual = max(soo - so * so / n - slope * slope * spread, 0.0) / (n - 2)
    variance = 2.0 * max(residual, fit.spread_px**2) / n + systematic
    rows = np.empty((2, 6))
    for k in range(2):
        along = middle + (2 * k - 1) * np.sqrt(spread / n)
        _point_at(samples.points[first:last], pixels[first:last], nu, nv, along, points[k])
        u, v, _ = pixel_rows(fit.T, lens, points[k], rows)
        s = nv * (u - pixels[first, 0]) - nu * (v - pixels[first, 1])
        offset = so / n + slope * (s - middle)
        places[k, 0], places[k, 1] = u + offset * nu, v + offset * nv
        _fill(covariances[k], variance, nu, nv)
    return 2


@njit(cache=True)
def _point_at(
    points: FloatArray, pixels: FloatArray, nu: float, nv: float, along: float, point: FloatArray
) -> None:
    """Fill the point (3,) of an edge at a distance along it from its first sample, px.

    Args:
        points: samples of the edge, in order along it, (N, 3).
        pixels: of them, (N, 2).
        nu: of the unit normal across the edge.
        nv: of the unit normal across the edge.
        along: the distance.
        point: set to the point.
    """
    a, b = 0, len(points) - 1
    rising = nv * (pixels[b, 0] - pixels[0, 0]) > nu * (pixels[b, 1] - pixels[0, 1])
    while b - a > 1:
        m = (a + b) // 2
        s = nv * (pixels[m, 0] - pixels[0, 0]) - nu * (pixels[m, 1] - pixels[0, 1])
        if (s < along) == rising:
            a = m
        else:
            b = m
    sa = nv * (pixels[a, 0] - pixels[0, 0]) - nu * (pixels[a, 1] - pixels[0, 1])
    sb = nv * (pixels[b, 0] - pixels[0, 0]) - nu * (pixels[b, 1] - pixels[0, 1])
    share = (along - sa) / (sb - sa)
    for j in range(3):
        point[j] = points[a, j] + share * (points[b, j] - points[a, j])


@njit(cache=True)
def _fill(covariance: FloatArray, across: float, nu: float, nv: float) -> None:
    """Fill a covariance (2, 2) with a variance across an edge, and a large one along it."""
    along = SLIDING_PX**2
    covariance[0, 0] = across * nu * nu + along * nv * nv
    covariance[1, 1] = across * nv * nv + along * nu * nu
    covariance[0, 1] = covariance[1, 0] = (across - along) * nu * nv
