"""Windows of an image and their averages: the three resolutions of [Nelson1995] section 2.3.

A window of even size n is named by its anchor pixel a: it covers the pixels a - n/2 … a + n/2 - 1,
so its centre is a - 1/2 whatever n is. The templates of all three levels share one anchor and
thereby one centre, and averaging blocks moves nothing.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from vergence.arrays import ImageArray

Patch = NDArray[np.float32]


@njit(cache=True)
def anchor_of(coordinate: float) -> int:
    """Return the anchor of the windows whose centre is nearest to a coordinate."""
    return int(np.floor(coordinate)) + 1


@njit(cache=True, fastmath=True)
def load_window(image: ImageArray, anchor_x: int, anchor_y: int, out: Patch) -> None:
    """Copy the window of out's size; beyond the border the nearest pixel is repeated."""
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
def halve(window: Patch, top: int, left: int, out: Patch) -> None:
    """Average 2 × 2 pixels of a window into each entry of out, from (top, left) on."""
    rows, columns = out.shape
    scale = np.float32(0.25)
    for i in range(rows):
        above = window[top + 2 * i, left : left + 2 * columns]
        below = window[top + 2 * i + 1, left : left + 2 * columns]
        target = out[i]
        for j in range(columns):
            target[j] = scale * (above[2 * j] + above[2 * j + 1] + below[2 * j] + below[2 * j + 1])


@njit(cache=True, fastmath=True)
def quarter(window: Patch, top: int, left: int, out: Patch) -> None:
    """Average 4 × 4 pixels of a window into each entry of out, from (top, left) on."""
    rows, columns = out.shape
    scale = np.float32(1.0 / 16.0)
    total = np.empty(4 * columns, np.float32)
    for i in range(rows):
        line0 = window[top + 4 * i, left : left + 4 * columns]
        line1 = window[top + 4 * i + 1, left : left + 4 * columns]
        line2 = window[top + 4 * i + 2, left : left + 4 * columns]
        line3 = window[top + 4 * i + 3, left : left + 4 * columns]
        for j in range(4 * columns):
            total[j] = line0[j] + line1[j] + line2[j] + line3[j]
        target = out[i]
        for j in range(columns):
            target[j] = scale * (
                total[4 * j] + total[4 * j + 1] + total[4 * j + 2] + total[4 * j + 3]
            )


@njit(cache=True, fastmath=True)
def smooth(window: Patch, out: Patch) -> None:
    """Smooth by (1 2 1)/4 along both axes; out loses one pixel at every side."""
    rows, columns = out.shape
    two, scale = np.float32(2.0), np.float32(1.0 / 16.0)
    for i in range(rows):
        above, here, below, target = window[i], window[i + 1], window[i + 2], out[i]
        for j in range(columns):
            left = above[j] + two * here[j] + below[j]
            middle = above[j + 1] + two * here[j + 1] + below[j + 1]
            right = above[j + 2] + two * here[j + 2] + below[j + 2]
            target[j] = scale * (left + two * middle + right)
