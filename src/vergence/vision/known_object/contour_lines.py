"""Lines across an outline, and where each of them leaves the object, by the colours along it.

Each pixel of a line belongs to the object or to what is beside it; its colour has odds of either.
For a contour at distance d along the line the pixels before d are the object's, those behind are
not: the probability of each d is the product over the pixels [Stoiber2022].
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from vergence.arrays import BoolArray, FloatArray, ImageArray
from vergence.vision.known_object.color_model import add_color, bin_of, direction_of
from vergence.vision.known_object.silhouette import Outline

REACH = 6  # segments to either side, where the contour is searched for
BEYOND = 4  # segments beyond the reach that are read
LEAST_DEEP_PX = 3.0  # thinner parts of the object, or of what is beside it, tell nothing
_AMPLITUDE = 0.43  # how much a pixel at full distance is believed, [Stoiber2022]
_SLOPE = 0.5  # of the step, segments
_SIZE = 2 * (REACH + BEYOND) + 1  # segments of a line
_FLAT = (2 * REACH + 1) ** 2 / 12.0  # variance where nothing is known, segments²


class ContourLines(NamedTuple):
    """Where lines across an outline find the contour."""

    offsets_px: FloatArray  # (N,) along the normal, from the place on the outline
    information: FloatArray  # (N,) inverse variance, 1/px²; 0 where the line tells nothing
    usable: BoolArray  # (N,) within the image, and both sides are deep enough to be distinguished
    deep_odds: FloatArray  # (N,) mean log odds of the pixels that are inside in any case


@njit(cache=True)
def read_lines(image: ImageArray, outline: Outline, odds: FloatArray, scale: int) -> ContourLines:
    """Find the contour on each line.

    Args:
        image: (height, width, 1 or 3).
        outline: where the lines are.
        odds: log odds of each colour to be the object's, by direction, (16, B).
        scale: pixels in a segment, odd.
    """
    count = len(outline.points_px)
    offsets, information = np.zeros(count), np.zeros(count)
    usable, deep = np.zeros(count, dtype=np.bool_), np.zeros(count)
    steps = np.empty(2 * _SIZE)
    for k in range(len(steps)):
        steps[k] = 0.5 - _AMPLITUDE * np.tanh((k - _SIZE) / (2.0 * _SLOPE))
    share, chance = np.empty(_SIZE), np.empty(2 * REACH + 1)
    for n in range(count):
        if min(outline.inside_px[n], outline.outside_px[n]) < LEAST_DEEP_PX:
            continue
        first, slant = _first_pixel(outline, n)
        if not _within(image, outline, n, slant):
            continue
        usable[n] = True
        own = odds[direction_of(outline.normals[n, 0], outline.normals[n, 1])]
        deep[n] = _segment_shares(image, outline, n, own, scale, slant, first, share)
        mean, variance = _contour_on(share, steps, chance)
        length = scale * slant  # of a segment, px
        offsets[n] = first + mean * length
        information[n] = max(1.0 / variance - 1.0 / _FLAT, 0.0) / (length * length)
    return ContourLines(offsets, information, usable, deep)


@njit(cache=True)
def _first_pixel(outline: Outline, n: int) -> tuple[float, float]:
    """Return how far along the normal the first pixel's centre lies, and how far the next, px.

    Along its steeper axis a line passes each pixel once.
    """
    nu, nv = outline.normals[n]
    axis = 0 if abs(nu) >= abs(nv) else 1
    along = outline.normals[n, axis]
    place = outline.points_px[n, axis]
    return (np.round(place) - place) / along, 1.0 / abs(along)


@njit(cache=True)
def _within(image: ImageArray, outline: Outline, n: int, slant: float) -> bool:
    """Return whether the least of a line that tells anything lies in the image."""
    for far in (-(LEAST_DEEP_PX + 1.0) * slant, (LEAST_DEEP_PX + 1.0) * slant):
        u = outline.points_px[n, 0] + far * outline.normals[n, 0]
        v = outline.points_px[n, 1] + far * outline.normals[n, 1]
        if not (0.0 <= u <= image.shape[1] - 1.0 and 0.0 <= v <= image.shape[0] - 1.0):
            return False
    return True


@njit(cache=True)
def _segment_shares(
    image: ImageArray,
    outline: Outline,
    n: int,
    odds: FloatArray,
    scale: int,
    slant: float,
    first: float,
    share: FloatArray,
) -> float:
    """Fill share (S,) with the probability that a segment is the object's; return the deep odds.

    Pixels beyond the object's other side, beyond another part of it, or outside the image say
    nothing. A segment's pixels count together.
    """
    u, v = outline.points_px[n]
    nu, nv = outline.normals[n]
    total, pixels = 0.0, 0
    for s in range(_SIZE):
        log_odds = 0.0
        for k in range(scale):
            far = first + ((s - REACH - BEYOND) * scale + k - scale // 2) * slant
            if not -outline.inside_px[n] <= far <= outline.outside_px[n]:
                continue
            column, row = int(np.floor(u + far * nu + 0.5)), int(np.floor(v + far * nv + 0.5))
            if not (0 <= row < image.shape[0] and 0 <= column < image.shape[1]):
                continue
            value = odds[bin_of(image, row, column)]
            log_odds += value
            if far < -LEAST_DEEP_PX:
                total += value
                pixels += 1
        share[s] = 1.0 / (1.0 + np.exp(-log_odds))
    return total / max(pixels, 1)


@njit(cache=True)
def _contour_on(share: FloatArray, steps: FloatArray, chance: FloatArray) -> tuple[float, float]:
    """Return mean and variance of where the contour is, segments from the middle of the line."""
    sum_0, sum_1, sum_2 = 0.0, 0.0, 0.0
    for d in range(2 * REACH + 1):
        product = 1.0
        for s in range(_SIZE):
            inner = steps[s - BEYOND - d + _SIZE]  # of a pixel's belonging to the object
            product *= inner * share[s] + (1.0 - inner) * (1.0 - share[s])
        chance[d] = product
        place = d - REACH
        sum_0 += product
        sum_1 += product * place
        sum_2 += product * place * place
    mean = sum_1 / sum_0
    return mean, max(sum_2 / sum_0 - mean * mean, 0.05)


@njit(cache=True)
def count_colors(
    image: ImageArray,
    outline: Outline,
    learned: BoolArray,
    covered: BoolArray,
    gaps_px: FloatArray,
    depth_px: float,
    inside: FloatArray,
    outside: FloatArray,
) -> None:
    """Add the colours along lines to the counts (16, B) of the object and of what is beside it.

    Args:
        image: (height, width, 1 or 3).
        outline: where the lines are.
        learned: lines on which the contour was found, (N,).
        covered: lines on which something is before the object, (N,): all of it is beside.
        gaps_px: how far from the outline to begin, inward and outward, (N, 2).
        depth_px: and where to end.
        inside: counts of the object.
        outside: counts of what is beside it.
    """
    for n in range(len(learned)):
        if not (learned[n] or covered[n]):
            continue
        u, v = outline.points_px[n]
        nu, nv = outline.normals[n]
        direction = direction_of(nu, nv)
        for side in (-1.0, 1.0):
            most = outline.inside_px[n] if side < 0.0 else outline.outside_px[n]
            counts = inside if side < 0.0 and learned[n] else outside
            gap_px = gaps_px[n, 0] if side < 0.0 else gaps_px[n, 1]
            for k in range(int(min(most, depth_px) - gap_px) + 1):
                far = side * (gap_px + k)
                column, row = int(np.floor(u + far * nu + 0.5)), int(np.floor(v + far * nv + 0.5))
                if 0 <= row < image.shape[0] and 0 <= column < image.shape[1]:
                    add_color(counts[direction], bin_of(image, row, column))
