"""Measures one corner: each edge is found across its prediction, then the edges are intersected.

Works in two passes: the first searches as far as the window allows, the second only near the result
of the first. Nothing outside the window (and the few pixels that filters need) is read.
"""

import numpy as np
from numba import njit

from vergence.arrays import FloatArray, ImageArray, IntArray
from vergence.vision.known_object.profiles import MARGIN, find_steps, read_profile

FOUND, OUTSIDE, NO_CONTRAST, INCONSISTENT, TOO_FEW, LEFT_WINDOW = range(6)
NEAR_PX = 2.5  # closer to the corner, the other edges disturb a profile
LONGEST_PX = 30.0  # length of an edge that is used, from the corner
SAMPLES = 10  # profiles per edge
STEPS = 3  # candidates per profile
BLUR = 4  # samples added to a profile beyond the search, to follow blurred edges
FINE_REACH = 3  # of the second pass, px
SLOPE_MAX = 0.3  # of a found edge relative to its prediction, first pass
TOLERANCE_PX = 1.0  # of a step from its line
SUPPORT = 0.6  # fraction of the profiles that must agree on a line
LEAST_VARIANCE = 0.05**2  # px², of a single position: interpolation and aliasing
MODEL_VARIANCE = 0.1**2  # px², of a whole line: aliasing and modelling, which do not average out
PARALLEL = 0.12  # sine of the angle below which two lines do not make a corner
AGREEMENT_PX = 0.8  # largest distance of a third edge from the corner


@njit(cache=True)
def fit_corner(
    image: ImageArray,
    u: float,
    v: float,
    directions: FloatArray,
    lengths: FloatArray,
    half_px: FloatArray,
    contrast: float,
    corner: FloatArray,
    covariance: FloatArray,
) -> int:
    """Measure one corner; fill corner (2,) and covariance (2, 2), px; return a code.

    Args:
        image: grey, (height, width).
        u: predicted column.
        v: predicted row.
        directions: unit vectors of the K expected edges in the image, away from the corner,
            (K, 2); overwritten by those found.
        lengths: their expected lengths, px, (K,).
        half_px: half the width and height of the window, (2,).
        contrast: smallest step of an edge, grey values.
        corner: set to the position.
        covariance: set to its covariance.
    """
    height, width = image.shape
    if not (0.0 <= u <= width - 1.0 and 0.0 <= v <= height - 1.0):
        return OUTSIDE
    half = min(half_px[0], half_px[1])
    reach = int(max(half - 4.0, FINE_REACH))
    corner[0], corner[1] = u, v
    lines = np.empty((len(directions), 4))
    for fine in range(2):
        code = _meet(
            image,
            directions,
            lengths,
            min(max(half, 12.0), LONGEST_PX),
            FINE_REACH if fine else reach,
            contrast,
            lines,
            corner,
            covariance,
        )
        if code != FOUND:
            return code
        if abs(corner[0] - u) > half_px[0] or abs(corner[1] - v) > half_px[1]:
            return LEFT_WINDOW
    return FOUND


@njit(cache=True)
def _meet(
    image: ImageArray,
    directions: FloatArray,
    lengths: FloatArray,
    longest: float,
    reach: int,
    contrast: float,
    lines: FloatArray,
    corner: FloatArray,
    covariance: FloatArray,
) -> int:
    """Find each edge as a line (nu, nv, c, variance) at the corner, and their intersection."""
    count, empty, outside = 0, 0, 0
    for k in range(len(directions)):
        length = min(longest, 0.9 * lengths[k])
        if length < NEAR_PX + 4.0:
            continue
        code = _fit_line(image, corner, directions[k], length, reach, contrast, lines[count])
        if code == FOUND:
            count += 1
        elif code == NO_CONTRAST:
            empty += 1
        elif code == OUTSIDE:
            outside += 1
    if count < 2:
        if outside:
            return OUTSIDE
        return NO_CONTRAST if empty else TOO_FEW
    return _intersect(lines[:count], corner, covariance)


@njit(cache=True)
def _fit_line(
    image: ImageArray,
    corner: FloatArray,
    direction: FloatArray,
    length: float,
    reach: int,
    contrast: float,
    line: FloatArray,
) -> int:
    """Find one edge; fill its line (nu, nv, c, variance of c), nu u + nv v = c, at the corner."""
    du, dv = direction[0], direction[1]
    nu, nv = -dv, du
    places = np.empty((SAMPLES, STEPS))
    heights = np.empty((SAMPLES, STEPS))
    widths = np.empty(STEPS)
    counts = np.zeros(SAMPLES, dtype=np.int64)
    profile = np.empty(2 * (reach + MARGIN + BLUR) + 1)
    spacing = (length - NEAR_PX) / (SAMPLES - 1)
    inside, seen = 0, 0
    for i in range(SAMPLES):
        s = NEAR_PX + i * spacing
        if read_profile(image, corner[0] + s * du, corner[1] + s * dv, nu, nv, profile):
            inside += 1
            counts[i] = find_steps(profile, reach, contrast, places[i], heights[i], widths)
            seen += counts[i] > 0
    if inside < SUPPORT * SAMPLES:
        return OUTSIDE
    if seen < SUPPORT * SAMPLES:
        return NO_CONTRAST
    a, b = _vote(places, heights, counts, spacing, reach)
    a, b, variance, agreeing = _regress(places, counts, spacing, a, b)
    if agreeing < SUPPORT * SAMPLES:
        return INCONSISTENT
    # The line passes corner + a n, in direction d + b n.
    norm = np.sqrt(1.0 + b * b)
    direction[0], direction[1] = (du + b * nu) / norm, (dv + b * nv) / norm
    line[0], line[1] = -direction[1], direction[0]
    line[2] = line[0] * (corner[0] + a * nu) + line[1] * (corner[1] + a * nv)
    line[3] = variance
    return FOUND


@njit(cache=True)
def _vote(
    places: FloatArray, heights: FloatArray, counts: IntArray, spacing: float, reach: int
) -> tuple[float, float]:
    """Return offset a and slope b of the line through two steps with the most support."""
    best, best_a, best_b = -1.0, 0.0, 0.0
    for i in range(SAMPLES):
        for m in range(i + SAMPLES // 2, SAMPLES):
            for j in range(counts[i]):
                for n in range(counts[m]):
                    b = (places[m, n] - places[i, j]) / ((m - i) * spacing)
                    if abs(b) > SLOPE_MAX or heights[i, j] * heights[m, n] < 0.0:
                        continue
                    a = places[i, j] - b * (NEAR_PX + i * spacing)
                    score = _support(places, heights, counts, spacing, a, b, heights[i, j])
                    middle = a + b * (NEAR_PX + 0.5 * (SAMPLES - 1) * spacing)
                    score *= 1.0 - 0.3 * min(1.0, abs(middle) / reach)
                    if score > best:
                        best, best_a, best_b = score, a, b
    return best_a, best_b


@njit(cache=True)
def _support(
    places: FloatArray,
    heights: FloatArray,
    counts: IntArray,
    spacing: float,
    a: float,
    b: float,
    sign: float,
) -> float:
    """Return the support of a line by the profiles; higher steps count somewhat more."""
    total = 0.0
    for i in range(SAMPLES):
        expected = a + b * (NEAR_PX + i * spacing)
        most = 0.0
        for j in range(counts[i]):
            miss = (places[i, j] - expected) / TOLERANCE_PX
            if abs(miss) < 1.0 and heights[i, j] * sign > 0.0:
                size = abs(heights[i, j])
                most = max(most, (1.0 - miss * miss) * size / (size + 20.0))
        total += most
    return total


@njit(cache=True)
def _regress(
    places: FloatArray, counts: IntArray, spacing: float, a: float, b: float
) -> tuple[float, float, float, int]:
    """Fit the line to the steps near it by least squares; return a, b, variance of a, count."""
    variance, count = np.inf, 0
    for _ in range(2):
        n, ss, so, sss, sso, soo = 0, 0.0, 0.0, 0.0, 0.0, 0.0
        for i in range(SAMPLES):
            s = NEAR_PX + i * spacing
            nearest, offset = TOLERANCE_PX, 0.0
            for j in range(counts[i]):
                if abs(places[i, j] - a - b * s) < nearest:
                    nearest, offset = abs(places[i, j] - a - b * s), places[i, j]
            if nearest < TOLERANCE_PX:
                n += 1
                ss += s
                so += offset
                sss += s * s
                sso += s * offset
                soo += offset * offset
        spread = sss - ss * ss / n if n > 0 else 0.0
        if n < 3 or spread <= 0.0:
            return a, b, np.inf, 0
        b = (sso - ss * so / n) / spread
        a = (so - b * ss) / n
        residual = max(soo - so * so / n - b * b * spread, 0.0) / (n - 2)
        variance = max(residual, LEAST_VARIANCE) * (1.0 / n + (ss / n) ** 2 / spread)
        count = n
    return a, b, variance + MODEL_VARIANCE, count


@njit(cache=True)
def _intersect(lines: FloatArray, corner: FloatArray, covariance: FloatArray) -> int:
    """Intersect lines by weighted least squares; fill corner and covariance; return a code."""
    a, b, c, p, q, widest = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for k in range(len(lines)):
        nu, nv, distance, weight = lines[k, 0], lines[k, 1], lines[k, 2], 1.0 / lines[k, 3]
        a += weight * nu * nu
        b += weight * nu * nv
        c += weight * nv * nv
        p += weight * nu * distance
        q += weight * nv * distance
        for m in range(k):
            widest = max(widest, abs(nu * lines[m, 1] - nv * lines[m, 0]))
    if widest < PARALLEL:
        return TOO_FEW
    determinant = a * c - b * b
    corner[0], corner[1] = (c * p - b * q) / determinant, (a * q - b * p) / determinant
    for k in range(len(lines)):
        miss = abs(lines[k, 0] * corner[0] + lines[k, 1] * corner[1] - lines[k, 2])
        if miss > AGREEMENT_PX + 3.0 * np.sqrt(lines[k, 3]):
            return INCONSISTENT
    covariance[0, 0], covariance[1, 1] = c / determinant, a / determinant
    covariance[0, 1] = covariance[1, 0] = -b / determinant
    return FOUND
