"""The search of [Nelson1995] section 2.3: the displacement that minimises the SSD, eq. (19).

Coarse, middle and full resolution, on one window of the image. Two departures from the paper:
the mean of template and window is taken out, so that a change of brightness costs nothing, and
the best few minima of the coarse level are followed to full resolution instead of one alone.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from vergence.arrays import ImageArray
from vergence.vision.pyramid import Patch, halve, load_window, quarter

RANGE_PX = 32  # the search reaches this far to every side
TEMPLATE_PX = 16  # side of the full-resolution template
COARSE, MIDDLE = 4, 2  # pixels averaged along each axis
SIDE = 8  # entries along a side of the averaged templates
CANDIDATES = 3  # minima of the coarse level that are followed
MIDDLE_REACH = 3  # middle pixels searched around each of them
FULL_REACH = 2  # pixels searched around the middle minimum


class SsdTemplate(NamedTuple):
    """What the search looks for: one window at three resolutions, all with the same centre."""

    coarse: Patch  # (8, 8) 32 × 32 px averaged
    middle: Patch  # (8, 8) 16 × 16 px averaged
    full: Patch  # (16, 16)


class SsdWorkspace(NamedTuple):
    """Memory that the search writes to, so that it allocates none."""

    window: Patch  # (96, 96) the part of the image that is searched
    averaged: Patch  # (24, 24) the same at the coarse level
    part: Patch  # (14, 14) a part of it at the middle level
    strip: Patch  # (320,) one column of positions, see ssd_surface
    surface: Patch  # (17, 17) SSD of the coarse level
    small: Patch  # (7, 7) SSD of the middle level
    tiny: Patch  # (5, 5) SSD at full resolution


def make_workspace() -> SsdWorkspace:
    """Allocate what one search needs."""
    reach = 2 * RANGE_PX // COARSE + 1
    shapes = ((96, 96), (24, 24), (14, 14), (320,), (reach, reach), (7, 7), (5, 5))
    return SsdWorkspace(*(np.zeros(shape, np.float32) for shape in shapes))


@njit(cache=True)
def make_template(image: ImageArray, anchor_x: int, anchor_y: int, out: SsdTemplate) -> None:
    """Fill a template from the windows at an anchor."""
    window = np.empty((COARSE * SIDE, COARSE * SIDE), np.float32)
    load_window(image, anchor_x, anchor_y, window)
    quarter(window, 0, 0, out.coarse)
    halve(window, 8, 8, out.middle)
    out.full[:] = window[8:24, 8:24]


@njit(cache=True, fastmath=True)
def ssd(strip: Patch, start: np.uint64, template: Patch) -> np.float32:
    """SSD of two flat patches, both freed of their mean: Σd² - (Σd)²/n, d = I - T.

    Indices are unsigned, since numba then need not think of negative ones, and sums run over
    blocks of fixed length: both together make this vector code.
    """
    squares, total = np.float32(0.0), np.float32(0.0)
    for block in range(np.uint64(0), np.uint64(template.size), np.uint64(64)):
        for k in range(np.uint64(64)):
            difference = strip[start + block + k] - template[block + k]
            squares += difference * difference
            total += difference
    return squares - total * total / np.float32(template.size)


@njit(cache=True, fastmath=True)
def ssd_surface(
    area: Patch, top: int, left: int, template: Patch, count: int, strip: Patch, out: Patch
) -> None:
    """SSD of a template at count × count positions of an area, [Nelson1995] eq. (19).

    Each column of positions is copied to a strip as wide as the template, in which the windows
    lie one below the other without a gap; the sums then run over flat memory.
    """
    height, width = np.uint64(template.shape[0]), np.uint64(template.shape[1])
    first, start, positions = np.uint64(top), np.uint64(left), np.uint64(count)
    flat = template.reshape(template.size)
    eight = np.uint64(8)
    for x in range(positions):
        for i in range(height + positions - np.uint64(1)):
            for block in range(np.uint64(0), width, eight):
                for j in range(eight):
                    strip[i * width + block + j] = area[first + i, start + x + block + j]
        for y in range(positions):
            out[y, x] = ssd(strip, y * width, flat)


@njit(cache=True)
def lowest(surface: Patch, rows: int, columns: int) -> tuple[int, int]:
    """Row and column of the smallest entry."""
    best, y, x = np.float32(np.inf), 0, 0
    for i in range(rows):
        for j in range(columns):
            if surface[i, j] < best:
                best, y, x = surface[i, j], i, j
    return y, x


@njit(cache=True)
def strike_out(surface: Patch, rows: int, columns: int, y: int, x: int) -> None:
    """Take a minimum and its eight neighbours out of a surface."""
    for i in range(max(y - 1, 0), min(y + 2, rows)):
        for j in range(max(x - 1, 0), min(x + 2, columns)):
            surface[i, j] = np.float32(np.inf)


@njit(cache=True)
def vertex(before: float, here: float, after: float) -> float:
    """Where the parabola through three neighbouring values is lowest, within half a pixel."""
    bend = before - 2.0 * here + after
    if bend <= 0.0:
        return 0.0
    return min(max(0.5 * (before - after) / bend, -0.5), 0.5)


@njit(cache=True)
def search(
    image: ImageArray, anchor_x: int, anchor_y: int, template: SsdTemplate, work: SsdWorkspace
) -> tuple[float, float, float]:
    """Find a template within ±32 px of an anchor.

    Returns:
        The displacement x and y of the best window from the anchor, px, with the vertex of a
        parabola as fraction; and the SSD there, grey levels² summed over 16 × 16 px.
    """
    load_window(image, anchor_x, anchor_y, work.window)
    quarter(work.window, 0, 0, work.averaged)
    reach = RANGE_PX // COARSE
    count = 2 * reach + 1
    ssd_surface(work.averaged, 0, 0, template.coarse, count, work.strip, work.surface)
    best, best_x, best_y = np.inf, 0.0, 0.0
    for _ in range(CANDIDATES):
        y, x = lowest(work.surface, count, count)
        if not np.isfinite(work.surface[y, x]):
            break
        strike_out(work.surface, count, count, y, x)
        value, dx, dy = refine(COARSE * (x - reach), COARSE * (y - reach), template, work)
        if value < best:
            best, best_x, best_y = value, dx, dy
    return best_x, best_y, best


@njit(cache=True)
def refine(x: int, y: int, template: SsdTemplate, work: SsdWorkspace) -> tuple[float, float, float]:
    """Follow one coarse minimum through the middle level to full resolution.

    Returns:
        The SSD and the displacement x, y with fraction.
    """
    # The window's corner is at -48 from its anchor; the area kept inside it shifts near its edge.
    span, count = MIDDLE * (SIDE + 2 * MIDDLE_REACH), 2 * MIDDLE_REACH + 1
    left = min(max(48 + x - span // 2, 0), 96 - span)
    top = min(max(48 + y - span // 2, 0), 96 - span)
    halve(work.window, top, left, work.part)
    ssd_surface(work.part, 0, 0, template.middle, count, work.strip, work.small)
    row, column = lowest(work.small, count, count)
    left += MIDDLE * column - FULL_REACH
    top += MIDDLE * row - FULL_REACH
    count = 2 * FULL_REACH + 1
    left = min(max(left, 0), 96 - TEMPLATE_PX - 2 * FULL_REACH)
    top = min(max(top, 0), 96 - TEMPLATE_PX - 2 * FULL_REACH)
    ssd_surface(work.window, top, left, template.full, count, work.strip, work.tiny)
    row, column = lowest(work.tiny, count, count)
    dx, dy = float(left + column + 8 - 48), float(top + row + 8 - 48)
    tiny = work.tiny
    if 0 < column < count - 1:
        dx += vertex(tiny[row, column - 1], tiny[row, column], tiny[row, column + 1])
    if 0 < row < count - 1:
        dy += vertex(tiny[row - 1, column], tiny[row, column], tiny[row + 1, column])
    return float(tiny[row, column]), dx, dy
