"""The search of [Nelson1995] section 2.3: the displacement that minimises the SSD, eq. (19).

Coarse, middle and full resolution, on one window of the image. Two departures from the paper:
the mean of template and window is taken out, so that a change of brightness costs nothing, and
the best few minima of the coarse level are followed to full resolution instead of one alone.
"""

from collections.abc import Callable
from typing import NamedTuple, TypeAlias

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
SEARCHED_PX = 2 * RANGE_PX + COARSE * SIDE  # side of the area that is searched
WORTH_FOLLOWING = 3.0  # times the best SSD of the middle level: followed to full resolution


SurfaceKernel: TypeAlias = Callable[[Patch, int, int, Patch, int, Patch, Patch], None]


class SsdTemplate(NamedTuple):
    """What the search looks for: one window at three resolutions, all with the same centre."""

    coarse: Patch  # (8, 8) 32 × 32 px averaged
    middle: Patch  # (8, 8) 16 × 16 px averaged
    full: Patch  # (16, 16)


TEMPLATE_SIZE = 8 * 8 + 8 * 8 + 16 * 16


@njit(cache=True)
def template_in(memory: Patch) -> SsdTemplate:
    """Lay a template out in flat memory of TEMPLATE_SIZE."""
    return SsdTemplate(
        memory[:64].reshape(8, 8), memory[64:128].reshape(8, 8), memory[128:].reshape(16, 16)
    )


class SsdWorkspace(NamedTuple):
    """Memory that the search writes to, so that it allocates none."""

    window: Patch  # (96, 96) the part of the image that is searched
    averaged: Patch  # (24, 24) the same at the coarse level
    part: Patch  # (14, 14) a part of it at the middle level
    strip: Patch  # (320,) one column of positions, see ssd_surface
    surface: Patch  # (17, 17) SSD of the coarse level
    small: Patch  # (7, 7) SSD of the middle level
    tiny: Patch  # (5, 5) SSD at full resolution
    candidates: Patch  # (3, 3) corner x, y and SSD at the middle level


WORKSPACE_SIZE = 96 * 96 + 24 * 24 + 14 * 14 + 320 + 17 * 17 + 7 * 7 + 5 * 5 + 3 * 3


@njit(cache=True)
def make_workspace(memory: Patch) -> SsdWorkspace:
    """Lay the parts of a workspace out in flat memory of WORKSPACE_SIZE."""
    return SsdWorkspace(
        memory[:9216].reshape(96, 96),
        memory[9216:9792].reshape(24, 24),
        memory[9792:9988].reshape(14, 14),
        memory[9988:10308],
        memory[10308:10597].reshape(17, 17),
        memory[10597:10646].reshape(7, 7),
        memory[10646:10671].reshape(5, 5),
        memory[10671:10680].reshape(3, 3),
    )


@njit(cache=True)
def make_template(
    image: ImageArray, anchor_x: int, anchor_y: int, window: Patch, out: SsdTemplate
) -> None:
    """Fill a template from the windows at an anchor; window (32, 32) is memory."""
    load_window(image, anchor_x, anchor_y, window)
    quarter(window, 0, 0, out.coarse)
    halve(window, 8, 8, out.middle)
    out.full[:] = window[8:24, 8:24]


def _surface_kernel(side: int) -> SurfaceKernel:
    """Make the SSD kernel for templates of one size; only fixed lengths become vector code.

    Indices are unsigned, since numba then need not think of negative ones.
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
        area: Patch, top: int, left: int, template: Patch, count: int, strip: Patch, out: Patch
    ) -> None:
        first, start, positions = np.uint64(top), np.uint64(left), np.uint64(count)
        flat = template.reshape(side * side)
        for x in range(positions):
            for i in range(width + positions - np.uint64(1)):
                for block in offsets:
                    for j in range(np.uint64(8)):
                        strip[i * width + block + j] = area[first + i, start + x + block + j]
            for y in range(positions):
                out[y, x] = ssd(strip, y * width, flat)

    return surface


# SSD of a template at count × count positions of an area from (top, left) on, template and window
# both freed of their mean: Σd² - (Σd)²/n with d = I - T, [Nelson1995] eq. (19). Each column of
# positions is copied to a strip as wide as the template, in which the windows lie one below the
# other without a gap, so that the sums run over flat memory.
ssd_surface_8 = _surface_kernel(8)
ssd_surface_16 = _surface_kernel(16)


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
    count = 2 * RANGE_PX // COARSE + 1
    ssd_surface_8(work.averaged, 0, 0, template.coarse, count, work.strip, work.surface)
    work.candidates[:, 2] = np.inf
    coarse_limit = np.inf
    for k in range(CANDIDATES):
        y, x = lowest(work.surface, count, count)
        if not work.surface[y, x] <= coarse_limit:
            break
        coarse_limit = WORTH_FOLLOWING * work.surface[y, x] if k == 0 else coarse_limit
        strike_out(work.surface, count, count, y, x)
        # The corner of the middle window stands 8 px from its anchor, that of the area 48.
        left, top, value = search_middle(COARSE * x + 8, COARSE * y + 8, template, work)
        found = work.candidates[k]
        found[0], found[1], found[2] = left, top, value
    limit = WORTH_FOLLOWING * work.candidates[:, 2].min()
    best, best_x, best_y = np.inf, 0.0, 0.0
    for k in range(CANDIDATES):
        found = work.candidates[k]
        if found[2] <= limit:
            column, row, total = search_full(int(found[0]), int(found[1]), template, work)
            if total < best:
                best, best_x, best_y = total, column, row
    start = (SEARCHED_PX - TEMPLATE_PX) / 2
    return best_x - start, best_y - start, best


@njit(cache=True)
def search_middle(
    left: int, top: int, template: SsdTemplate, work: SsdWorkspace
) -> tuple[int, int, float]:
    """Search the middle level around a window given by its corner in the area.

    Returns:
        The corner of the best window, left and top, and the SSD there. Near the edge of the area
        the positions searched shift inwards.
    """
    count = 2 * MIDDLE_REACH + 1
    last = SEARCHED_PX - MIDDLE * (SIDE + 2 * MIDDLE_REACH)
    left = min(max(left - MIDDLE * MIDDLE_REACH, 0), last)
    top = min(max(top - MIDDLE * MIDDLE_REACH, 0), last)
    halve(work.window, top, left, work.part)
    ssd_surface_8(work.part, 0, 0, template.middle, count, work.strip, work.small)
    row, column = lowest(work.small, count, count)
    return left + MIDDLE * column, top + MIDDLE * row, float(work.small[row, column])


@njit(cache=True)
def search_full(
    left: int, top: int, template: SsdTemplate, work: SsdWorkspace
) -> tuple[float, float, float]:
    """Search full resolution around a window given by its corner, as search_middle does.

    Returns:
        The corner of the best window with fraction, left and top, and the SSD there.
    """
    count, tiny = 2 * FULL_REACH + 1, work.tiny
    last = SEARCHED_PX - TEMPLATE_PX - 2 * FULL_REACH
    left = min(max(left - FULL_REACH, 0), last)
    top = min(max(top - FULL_REACH, 0), last)
    ssd_surface_16(work.window, top, left, template.full, count, work.strip, tiny)
    row, column = lowest(tiny, count, count)
    x, y = float(left + column), float(top + row)
    if 0 < column < count - 1:
        x += vertex(tiny[row, column - 1], tiny[row, column], tiny[row, column + 1])
    if 0 < row < count - 1:
        y += vertex(tiny[row - 1, column], tiny[row, column], tiny[row + 1, column])
    return x, y, float(tiny[row, column])
