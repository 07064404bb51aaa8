"""Moving edges: grey-level steps along the normals of an expected curve, and a curve fit.

A curve whose points move linearly with its parameters, offset_k = a_k · δ along the normal k, is
fitted to the steps across it. Of several steps across one point, the one that agrees with the
others is used.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from vergence.arrays import BoolArray, FloatArray, ImageArray
from vergence.vision.known_object.profiles import MARGIN, SHARP_WIDTH, find_steps, grey_at

CANDIDATES = 4  # steps kept per position
BORDER_PX = 2.0  # no position of a curve closer to the border of the image is used
_BLUR = 5  # samples added to a profile beyond the search, to follow blurred edges
_NARROWING = 0.5  # of the gate, from one round of the fit to the next
_LEAST_GATE_PX = 1.0
_GATE_DEVIATIONS = 4.0  # of the residuals; a step beyond it has no weight: Tukey's biweight
_LIKE = 0.4  # smallest ratio of a step's height to the usual one, in either direction
_WIDTH_SQUARED = 8.0 * np.log(2.0)  # squared width at half height of a bell of variance 1
_PIXEL_VARIANCE = 1.0 / 12.0  # px², of the square area of a pixel
_ALONG_VARIANCE = 0.5  # px², of the mean along the edge, with weights 1, 2, 1
FLOOR_PX = 0.05  # lower bound on the standard deviation of a step


class Steps(NamedTuple):
    """Steps across N positions of a curve, up to K each."""

    offsets: FloatArray  # (N, K) along the normal, px
    heights: FloatArray  # (N, K) signed, grey values; 0 where there is none
    widths: FloatArray  # (N, K) of the slopes at half their height, px
    inside: BoolArray  # (N,) whether the position lies in the image


class CurveFit(NamedTuple):
    """The change of a curve's parameters that its steps determine."""

    change: FloatArray  # (P,)
    covariance: FloatArray  # (P, P)
    used: BoolArray  # (N,) positions whose step agrees
    height: float  # median of the steps used, grey values
    deviation_px: float  # of the steps used from the curve


@njit(cache=True)
def search_edges(
    image: ImageArray, places: FloatArray, normals: FloatArray, reach: int, contrast: float
) -> Steps:
    """Find the steps across the positions of a curve.

    Args:
        image: grey, (height, width).
        places: on the curve, (N, 2), px.
        normals: unit vectors, (N, 2).
        reach: search distance to either side, px.
        contrast: smallest height of a step, grey values.
    """
    count = len(places)
    offsets, heights = np.zeros((count, CANDIDATES)), np.zeros((count, CANDIDATES))
    widths = np.zeros((count, CANDIDATES))
    inside = np.zeros(count, dtype=np.bool_)
    profile = np.empty(2 * (reach + MARGIN + _BLUR) + 1)
    bottom, right = image.shape[0] - 1.0, image.shape[1] - 1.0
    for k in range(count):
        u, v = places[k]
        inside[k] = BORDER_PX <= u <= right - BORDER_PX and BORDER_PX <= v <= bottom - BORDER_PX
        if inside[k]:
            _read(image, u, v, normals[k, 0], normals[k, 1], profile)
            find_steps(profile, reach, contrast, offsets[k], heights[k], widths[k])
    return Steps(offsets, heights, widths, inside)


@njit(cache=True)
def _read(image: ImageArray, u: float, v: float, nu: float, nv: float, profile: FloatArray) -> None:
    """Read grey along a normal, each a mean along the edge; beyond the border as at the border."""
    middle = len(profile) // 2
    bottom, right = image.shape[0] - 1.0, image.shape[1] - 1.0
    for k in range(len(profile)):
        total = 0.0
        for side in range(-1, 2):
            x = u + (k - middle) * nu - side * nv
            y = v + (k - middle) * nv + side * nu
            share = 0.5 if side == 0 else 0.25
            total += share * grey_at(image, min(max(x, 0.0), right), min(max(y, 0.0), bottom))
        profile[k] = total


def straightened(steps: Steps, curvature: FloatArray) -> Steps:
    """Return the steps corrected to those across a straight edge.

    Blur of variance σ² moves the steepest point of an edge by half σ² times its curvature towards
    the centre of curvature. The variance is that of the image, from the width of the slope, and of
    the mean along the edge.

    Args:
        steps: along normals that point away from the centre of curvature.
        curvature: of the curve at each position, (N,), 1/px.
    """
    blur = np.maximum(steps.widths**2 - SHARP_WIDTH**2, 0.0) / _WIDTH_SQUARED
    shift = 0.5 * curvature[:, None] * (blur + _PIXEL_VARIANCE + _ALONG_VARIANCE)
    return steps._replace(offsets=steps.offsets + shift)


@njit(cache=True)
def fit_steps(A: FloatArray, steps: Steps, height: float, gate_px: float) -> CurveFit:
    """Fit a curve to steps across it, robustly.

    Args:
        A: motion of each position along its normal by each parameter, (N, P).
        steps: across the positions.
        height: usual height of its steps, signed; 0 if unknown.
        gate_px: initial distance of a step from its expected position within which it is used.
    """
    count, size = A.shape
    change, covariance = np.zeros(size), np.full((size, size), np.inf)
    used, chosen = np.zeros(count, dtype=np.bool_), np.zeros(count)
    tall = np.zeros(count)
    gate, deviation = gate_px, gate_px
    settled = 0
    while settled < 3:
        H, g = np.zeros((size, size)), np.zeros(size)
        for k in range(count):
            expected = 0.0
            for p in range(size):
                expected += A[k, p] * change[p]
            used[k], weight = False, 0.0
            for j in range(CANDIDATES):
                likeness = _likeness(steps.heights[k, j], height)
                miss = (steps.offsets[k, j] - expected) / gate
                vote = likeness * (1.0 - miss * miss) ** 2 if abs(miss) < 1.0 else 0.0
                if vote > weight:
                    weight, used[k] = vote, True
                    chosen[k], tall[k] = steps.offsets[k, j], steps.heights[k, j]
            for p in range(size):
                g[p] += weight * A[k, p] * chosen[k]
                for r in range(size):
                    H[p, r] += weight * A[k, p] * A[k, r]
        if np.count_nonzero(used) < size + 2 or np.linalg.cond(H) > 1e12:
            return CurveFit(change, covariance, np.zeros(count, dtype=np.bool_), 0.0, np.inf)
        covariance = np.ascontiguousarray(np.linalg.inv(H))
        change = covariance @ g
        residuals = np.abs(chosen - A @ change)[used]
        free = len(residuals) / (len(residuals) - size)
        deviation = 1.4826 * np.median(residuals) * np.sqrt(free)
        narrow = max(_GATE_DEVIATIONS * deviation, _LEAST_GATE_PX)
        settled += 1 if gate <= narrow else 0
        gate = max(_NARROWING * gate, narrow)
    spread = max(deviation, FLOOR_PX)
    scaled = np.ascontiguousarray(spread * spread * covariance)
    return CurveFit(change, scaled, used, np.median(tall[used]), deviation)


@njit(cache=True)
def _likeness(step: float, height: float) -> float:
    """Return the similarity of a step to the usual one of the curve, 0 … 1."""
    if step == 0.0:
        return 0.0
    if height == 0.0:
        return abs(step) / (abs(step) + 20.0)
    ratio = step / height
    if ratio < _LIKE or ratio > 1.0 / _LIKE:
        return 0.0
    return min(ratio, 1.0 / ratio)
