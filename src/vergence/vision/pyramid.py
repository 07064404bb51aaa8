"""Windows of an image and their averages: the three resolutions of [Nelson1995] section 2.3.

A window of even size n is identified by its anchor pixel a: it covers the pixels a - n/2 … a + n/2
- 1, so its centre is a - 1/2 whatever n is. The templates of all three levels share one anchor and
  hence
one centre, and averaging blocks causes no shift.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from vergence.arrays import ImageArray

Patch = NDArray[np.float32]


@njit(cache=True, inline="always")
def anchor_of(coordinate: float) -> int:
    """Return the anchor of the windows whose centre is nearest to a coordinate."""
    return int(np.floor(coordinate)) + 1


@njit(cache=True, fastmath=True)
def load_window(image: ImageArray, anchor_x: int, anchor_y: int, out: Patch) -> None:
    """Copy a window of out's size; beyond the border the nearest pixel is repeated."""
    height, width = image.shape
    rows, columns = out.shape
    top, left = anchor_y - rows // 2, anchor_x - columns // 2
    inside = left >= 0 and left + columns <= width
    for i in range(rows):
        source = image[min(max(top + i, 0), height - 1)]
        target = out[i]
        if inside:
            part = source[left : left + columns]
            for j in range(columns):
                target[j] = np.float32(part[j])
        else:
            for j in range(columns):
                target[j] = np.float32(source[min(max(left + j, 0), width - 1)])


@njit(cache=True, fastmath=True)
def halve(window: Patch, out: Patch) -> None:
    """Average 2 × 2 samples of a window into each sample of out."""
    rows, columns = out.shape
    scale = np.float32(0.25)
    for i in range(rows):
        above = window[2 * i, : 2 * columns]
        below = window[2 * i + 1, : 2 * columns]
        target = out[i]
        for j in range(columns):
            target[j] = scale * (above[2 * j] + above[2 * j + 1] + below[2 * j] + below[2 * j + 1])


@njit(cache=True, fastmath=True)
def average_rows(rows: ImageArray, start: int, total: NDArray[np.uint16], out: Patch) -> None:
    """Average 4 × 4 pixels of four rows into each sample of out, starting at a column.

    First by columns, then by rows, so that both loops are vectorised. total is work memory of four
    times the size of out.
    """
    first, second, third, fourth = rows[0], rows[1], rows[2], rows[3]
    begin, four, scale = np.uint64(start), np.uint64(4), np.float32(1.0 / 16.0)
    one, two, three = np.uint64(1), np.uint64(2), np.uint64(3)
    for j in range(np.uint64(4 * out.size)):
        k = begin + j
        total[j] = np.uint16(first[k] + second[k] + third[k] + fourth[k])
    for j in range(np.uint64(out.size)):
        k = four * j
        block = np.uint32(total[k] + total[k + one] + total[k + two] + total[k + three])
        out[j] = scale * np.float32(np.int32(block))


@njit(cache=True)
def load_quarter(image: ImageArray, anchor_x: int, anchor_y: int, out: Patch) -> None:
    """Average 4 × 4 pixels of the window at an anchor into each sample of out, as load_window."""
    height, width = image.shape
    rows, columns = out.shape
    top, left = anchor_y - 2 * rows, anchor_x - 2 * columns
    inside = left >= 0 and left + 4 * columns <= width
    total = np.empty(4 * columns, np.uint16)
    if inside and top >= 0 and top + 4 * rows <= height:
        for i in range(rows):
            average_rows(image[top + 4 * i : top + 4 * i + 4], left, total, out[i])
        return
    part = np.empty((4, 4 * columns), np.uint8)
    for i in range(rows):
        for k in range(4):
            source = image[min(max(top + 4 * i + k, 0), height - 1)]
            for j in range(4 * columns):
                part[k, j] = source[min(max(left + j, 0), width - 1)]
        average_rows(part, 0, total, out[i])
