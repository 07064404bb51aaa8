"""Where in a whole image the contour of an object fits best: every shift of it is tried."""

from typing import NamedTuple

import numpy as np
from numba import njit

from vergence.arrays import FloatArray, IntArray
from vergence.vision.known_object.color_model import direction_of
from vergence.vision.known_object.contour_maps import Maps

MOST_PLACES = 64  # of a contour: their sum stays within 16 bits


class Contour(NamedTuple):
    """Places on the edges or on the outline that an object shows at a pose."""

    points_px: FloatArray  # (N, 2)
    normals: FloatArray  # (N, 2) unit normals in the image, outward for an outline


def contour_of(points_px: FloatArray, normals: FloatArray) -> Contour:
    """Return a contour of `MOST_PLACES` at most, of places (N, 2) in order and their normals."""
    count = len(points_px)
    chosen = np.linspace(0, max(count - 1, 0), min(count, MOST_PLACES)).round().astype(np.int64)
    return Contour(points_px[chosen], normals[chosen])


class Vote(NamedTuple):
    """The best place of a contour."""

    score: float  # mean of the maps under the contour, 0 … 1
    column: int  # of its centre, cells
    row: int


@njit(cache=True)
def directions_of(normals: FloatArray) -> IntArray:
    """Return the direction index of each normal, (N,)."""
    directions = np.empty(len(normals), dtype=np.int64)
    for n in range(len(normals)):
        directions[n] = direction_of(normals[n, 0], normals[n, 1])
    return directions


@njit(cache=True)
def vote_place(maps: Maps, cells: IntArray, directions: IntArray, window: IntArray) -> Vote:
    """Return the shift of a contour under which the maps show it best.

    Places outside the image count as not shown.

    Args:
        maps: by direction, (16, rows, columns).
        cells: column and row of each place relative to the centre, (N, 2), `MOST_PLACES` at most.
        directions: of the normals, (N,).
        window: first column and row at which the centre may lie, and last + 1 of each, (4,).
    """
    rows, columns = maps.shape[1:]
    total = np.zeros((rows, columns), dtype=np.uint16)
    left, top, right, bottom = window
    for n in range(len(cells)):
        x, y = cells[n, 0], cells[n, 1]
        shown = maps[directions[n]]
        first, last = max(left, -x), min(right, columns - x)
        for row in range(max(top, -y), min(bottom, rows - y)):
            sums = total[row, first:last]
            added = shown[row + y, first + x : last + x]
            for k in range(len(sums)):  # whole slices become vector instructions
                sums[k] += added[k]
    row, column = top, left
    for r in range(top, bottom):
        for c in range(left, right):
            if total[r, c] > total[row, column]:
                row, column = r, c
    return Vote(total[row, column] / (255.0 * max(len(cells), 1)), column, row)
