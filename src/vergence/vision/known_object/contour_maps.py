"""How strongly each cell of a coarse image shows a contour, for each direction of its normal.

The direction is that of the outward normal, as in `color_model`: an object's outline has a side,
which its colours tell. A sharp edge has none, so opposite directions have the same map.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from vergence.arrays import FloatArray, ImageArray
from vergence.vision.known_object.color_model import DIRECTIONS, MOST_ODDS, bin_of

Maps = NDArray[np.uint8]  # (16, rows, columns), 0: no contour … 255
_BESIDE = 1.5  # cells from a contour to the cells on both sides of it that are compared
_USUAL_STEP = 15.0  # difference of grey values over two cells that counts half


@njit(cache=True)
def outline_maps(image: ImageArray, odds: FloatArray) -> Maps:
    """Return where colours of an object give way to those beside it.

    Args:
        image: coarse, (rows, columns, 1 or 3).
        odds: log odds of each colour to be the object's, by direction, (16, B).
    """
    rows, columns = image.shape[:2]
    bins = np.empty((rows, columns), dtype=np.int64)
    for row in range(rows):
        for column in range(columns):
            bins[row, column] = bin_of(image, row, column)
    maps = np.zeros((DIRECTIONS, rows, columns), dtype=np.uint8)
    scale = 255.0 / (2.0 * MOST_ODDS)
    for d in range(DIRECTIONS):
        angle = 2.0 * np.pi * d / DIRECTIONS
        dx, dy = int(np.round(_BESIDE * np.cos(angle))), int(np.round(_BESIDE * np.sin(angle)))
        for row in range(2, rows - 2):
            for column in range(2, columns - 2):
                inside = odds[d, bins[row - dy, column - dx]]
                outside = odds[d, bins[row + dy, column + dx]]
                maps[d, row, column] = int(scale * max(inside - outside, 0.0))
    return maps


@njit(cache=True)
def edge_maps(image: ImageArray) -> Maps:
    """Return where grey values change.

    Args:
        image: coarse, grey, (rows, columns).
    """
    rows, columns = image.shape
    maps = np.zeros((DIRECTIONS, rows, columns), dtype=np.uint8)
    half = DIRECTIONS // 2
    angles = np.pi * np.arange(half) / half
    cosines, sines = np.cos(angles), np.sin(angles)
    for row in range(1, rows - 1):
        for column in range(1, columns - 1):
            x = float(image[row, column + 1]) - float(image[row, column - 1])
            y = float(image[row + 1, column]) - float(image[row - 1, column])
            step = np.sqrt(x * x + y * y)
            if step == 0.0:
                continue
            strength = 255.0 * step / (step + _USUAL_STEP)
            for d in range(half):
                along = (x * cosines[d] + y * sines[d]) / step
                value = int(strength * along**4)
                maps[d, row, column] = value
                maps[d + half, row, column] = value
    return maps
