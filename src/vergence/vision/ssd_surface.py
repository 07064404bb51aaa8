"""The SSD of a template at all positions of an area, [Nelson1995] eq. (19), and its minima."""

from collections.abc import Callable
from typing import TypeAlias

import numpy as np
from numba import njit

from vergence.arrays import ImageArray
from vergence.vision.pyramid import Patch, load_window

RANGE_PX = 32  # search distance to every side
SIDE = 8  # samples along a side of the averaged templates
STRUCK_OUT = 1e30

SurfaceKernel: TypeAlias = Callable[[Patch, int, Patch, int, Patch, Patch], None]


def _surface_kernel(side: int) -> SurfaceKernel:
    """Return the SSD kernel for templates of one size; only fixed lengths are vectorised.

    Indices are unsigned, which avoids numba's negative-index check.
    """
    width, count64, blocks = np.uint64(side), np.uint64(side * side), range(0, side, 8)
    weight = np.float32(1.0 / (side * side))
    offsets = tuple(np.uint64(block) for block in blocks)

    @njit(cache=True, fastmath=True)
    def ssd(strip: Patch, start: np.uint64, template: Patch) -> np.float32:
        squares, total = np.float32(0.0), np.float32(0.0)
        for k in range(count64):
            difference = strip[start + k] - template[k]
            squares += difference * difference
            total += difference
        return squares - total * total * weight

    @njit(cache=True, fastmath=True)
    def surface(
        area: Patch, corner: int, template: Patch, count: int, strip: Patch, out: Patch
    ) -> None:
        positions, start = np.uint64(count), np.uint64(corner)
        flat = template.reshape(side * side)
        for x in range(positions):
            for i in range(width + positions - np.uint64(1)):
                for block in offsets:
                    for j in range(np.uint64(8)):
                        strip[i * width + block + j] = area[start + i, start + x + block + j]
            for y in range(positions):
                out[y, x] = ssd(strip, y * width, flat)

    return surface


# SSD of a template at count × count positions of an area from (corner, corner) on, with the means
# of template and window subtracted: Σd² - (Σd)²/n with d = I - T, [Nelson1995] eq. (19). Each
# column of positions is copied to a strip as wide as the template, in which the windows are stored
# contiguously one below the other, so that the sums run over flat memory.
ssd_surface_8 = _surface_kernel(8)
ssd_surface_16 = _surface_kernel(16)


@njit(cache=True)
def ssd_around(
    image: ImageArray, anchor_x: int, anchor_y: int, template: Patch, reach: int
) -> Patch:
    """SSD of a full template (16, 16) at all positions within a reach of an anchor, px, square."""
    count = 2 * reach + 1
    side = count + 2 * SIDE - 1
    area, strip = np.empty((side, side), np.float32), np.empty(2 * SIDE * side, np.float32)
    load_window(image, anchor_x, anchor_y, area)
    surface = np.empty((count, count), np.float32)
    ssd_surface_16(area, 0, template, count, strip, surface)
    return surface


@njit(cache=True)
def blot_out(surface: Patch, row: int, column: int) -> None:
    """Remove a minimum and all within 2 px of it from a surface at full resolution."""
    for i in range(max(row - 2, 0), min(row + 3, len(surface))):
        for j in range(max(column - 2, 0), min(column + 3, len(surface))):
            surface[i, j] = np.float32(STRUCK_OUT)


@njit(cache=True, fastmath=True)
def lowest(surface: Patch, rows: int, columns: int) -> tuple[int, int]:
    """Return row and column of the smallest element: the row first, as vector code."""
    best, y, x = surface[0, 0], 0, 0
    for i in range(rows):
        row, least = surface[i], surface[i, 0]
        for j in range(columns):
            least = min(least, row[j])
        if least < best:
            best, y = least, i
    while x < columns - 1 and surface[y, x] > best:
        x += 1
    return y, x


@njit(cache=True, inline="always")
def strike_out(surface: Patch, rows: int, columns: int, y: int, x: int) -> None:
    """Remove a minimum and its eight neighbours from a surface."""
    for i in range(max(y - 1, 0), min(y + 2, rows)):
        for j in range(max(x - 1, 0), min(x + 2, columns)):
            surface[i, j] = np.float32(STRUCK_OUT)


@njit(cache=True, inline="always")
def vertex(before: float, here: float, after: float) -> float:
    """Return the position of the minimum of a parabola through three values, ±0.5 at most."""
    bend = before - 2.0 * here + after
    if bend <= 0.0:
        return 0.0
    return min(max(0.5 * (before - after) / bend, -0.5), 0.5)
