"""Colours of an object and of its surroundings along its outline, by the outline's direction.

The shading of a smooth surface depends on the direction of its normal, which on the outline is the
normal in the image. Histograms for sixteen directions, each mixed with its neighbours and with all
others, therefore distinguish a shaded side from a dark background; one histogram would not.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from vergence.arrays import FloatArray, ImageArray

DIRECTIONS = 16
GREY_LEVELS, COLOR_LEVELS = 64, 16  # of each channel
MOST_ODDS = 3.0  # of one pixel's colour, natural logarithm: no pixel decides alone
# Fractions this small carry little information. A colour never seen before is more likely that of
# something else than the object's, whose colours are known.
_RARE_INSIDE, _RARE_OUTSIDE = 2e-4, 4e-4
_NEIGHBOURS = 0.5  # weight of the neighbouring directions
_ALL = 0.03  # weight of every direction


class ColorModel(NamedTuple):
    """Frequency of each colour in an object and beside it, B colours."""

    inside: FloatArray  # (16, B) fractions, each row's sum 1; zeros before the first image
    outside: FloatArray  # (16, B)
    odds: FloatArray  # (16, B) log of their ratio, bounded

    @property
    def known(self) -> bool:
        """Whether any image has been learned."""
        return bool(self.inside.any())


def blank_colors(channels: int) -> ColorModel:
    """Return the model before the first image.

    Args:
        channels: 1 for grey images, 3 for colour.
    """
    zeros = np.zeros((DIRECTIONS, GREY_LEVELS if channels == 1 else COLOR_LEVELS**3))
    return ColorModel(zeros, zeros, zeros)


@njit(cache=True)
def bin_of(image: ImageArray, row: int, column: int) -> int:
    """Return the bin of a pixel of an image (height, width, 1 or 3)."""
    if image.shape[2] == 1:
        return int(np.int64(image[row, column, 0]) // (256 // GREY_LEVELS))
    code = np.int64(0)  # a byte alone would become unsigned, which is not an index
    for channel in range(3):
        level = np.int64(image[row, column, channel]) // (256 // COLOR_LEVELS)
        code = code * COLOR_LEVELS + level
    return int(code)


@njit(cache=True)
def add_color(counts: FloatArray, code: int) -> None:
    """Add a pixel to counts (B,), spread over its bin and adjacent ones, as noise spreads it."""
    if len(counts) == GREY_LEVELS:
        for k in range(-1, 2):
            counts[min(max(code + k, 0), GREY_LEVELS - 1)] += 1.0 - 0.5 * abs(k)
        return
    top, size = COLOR_LEVELS - 1, COLOR_LEVELS
    first, second, third = code // (size * size), code // size % size, code % size
    for a in range(-1, 2):
        for b in range(-1, 2):
            row = min(max(first + a, 0), top) * size + min(max(second + b, 0), top)
            weight = (1.0 - 0.5 * abs(a)) * (1.0 - 0.5 * abs(b))
            for c in range(-1, 2):
                place = row * size + min(max(third + c, 0), top)
                counts[place] += weight * (1.0 - 0.5 * abs(c))


@njit(cache=True)
def direction_of(nu: float, nv: float) -> int:
    """Return the direction index of a normal in the image, 0 … DIRECTIONS - 1."""
    turn = np.arctan2(nv, nu) / (2.0 * np.pi)
    return int(np.floor(turn * DIRECTIONS + 0.5)) % DIRECTIONS


@njit(cache=True)
def colors_of(inside: FloatArray, outside: FloatArray) -> ColorModel:
    """Return counts by direction, (16, B) each, as a model."""
    return with_odds(_shares(inside), _shares(outside))


@njit(cache=True)
def mixed_colors(old: ColorModel, new: ColorModel, share: float) -> ColorModel:
    """Return a mixture of two models with a given share of the new one."""
    return with_odds(
        (1.0 - share) * old.inside + share * new.inside,
        (1.0 - share) * old.outside + share * new.outside,
    )


@njit(cache=True)
def with_odds(inside: FloatArray, outside: FloatArray) -> ColorModel:
    """Return the model for fractions inside and outside, (16, B) each."""
    odds = np.empty_like(inside)
    unseen = np.log(_RARE_INSIDE / _RARE_OUTSIDE)
    for d in range(odds.shape[0]):
        for k in range(odds.shape[1]):
            odds[d, k] = unseen
            if inside[d, k] + outside[d, k] > 0.0:
                ratio = np.log((inside[d, k] + _RARE_INSIDE) / (outside[d, k] + _RARE_OUTSIDE))
                odds[d, k] = min(max(ratio, -MOST_ODDS), MOST_ODDS)
    return ColorModel(inside, outside, odds)


@njit(cache=True)
def _shares(counts: FloatArray) -> FloatArray:
    """Return counts (16, B) as fractions, each direction mixed with its neighbours and with all."""
    shares, everywhere = np.empty_like(counts), np.zeros(counts.shape[1])
    for d in range(DIRECTIONS):
        everywhere += counts[d]
    for d in range(DIRECTIONS):
        left, right = counts[(d - 1) % DIRECTIONS], counts[(d + 1) % DIRECTIONS]
        total = 1e-12
        for k in range(counts.shape[1]):
            share = counts[d, k] + _NEIGHBOURS * (left[k] + right[k]) + _ALL * everywhere[k]
            shares[d, k] = share
            total += share
        shares[d] /= total
    return shares
