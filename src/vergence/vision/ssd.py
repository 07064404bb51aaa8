"""The search of [Nelson1995] section 2.3: the displacement that minimises the SSD, eq. (19).

Coarse, middle and full resolution, on windows of the image alone. Departures from the paper, each
because it makes the search right more often: the mean of template and window is taken out, so that
a change of brightness costs nothing; a level of half the coarse resolution and twice its window
joins the coarse level, so that one of many equal marks is told by its surroundings; the best few
minima of the coarse level are followed to full resolution; a far window has to match a little
better than a near one.
"""

from collections.abc import Callable
from typing import NamedTuple, TypeAlias

import numpy as np
from numba import njit

from vergence.arrays import ImageArray
from vergence.vision.pyramid import Patch, halve, load_quarter, load_window

RANGE_PX = 32  # the search reaches this far to every side
COARSE, MIDDLE = 4, 2  # pixels averaged along each axis
SIDE = 8  # entries along a side of the averaged templates
POSITIONS = 2 * RANGE_PX // COARSE + 1  # along each axis of the coarse level
WIDE_POSITIONS = RANGE_PX // COARSE + 1
CANDIDATES = 3  # minima of the coarse level that are followed
MIDDLE_REACH = 3  # middle pixels searched around each of them
FULL_REACH = 2  # pixels searched around the middle minimum
WIDE_SHARE = 1.0  # weight of the surroundings against the coarse template
DISTANCE_COST = 0.6  # at 32 px, in units of the template's variance
WORTH_FOLLOWING = 2.0  # times the best sum so far: candidates followed to full resolution

SurfaceKernel: TypeAlias = Callable[[Patch, int, Patch, int, Patch, Patch], None]


class SsdTemplate(NamedTuple):
    """What the search looks for: one window at four resolutions, all with the same centre."""

    wide: Patch  # (8, 8) 64 × 64 px averaged
    coarse: Patch  # (8, 8) 32 × 32 px averaged
    middle: Patch  # (8, 8) 16 × 16 px averaged
    full: Patch  # (16, 16)


TEMPLATE_SIZE = 3 * 8 * 8 + 16 * 16


@njit(cache=True)
def template_in(memory: Patch) -> SsdTemplate:
    """Lay a template out in flat memory of TEMPLATE_SIZE."""
    return SsdTemplate(
        memory[:64].reshape(8, 8),
        memory[64:128].reshape(8, 8),
        memory[128:192].reshape(8, 8),
        memory[192:].reshape(16, 16),
    )


class SsdWorkspace(NamedTuple):
    """Memory that the search writes to, so that it allocates none."""

    coarse: Patch  # (32, 32) 128 × 128 px around the anchor, averaged
    wide: Patch  # (16, 16) the same at half that resolution
    window: Patch  # (28, 28) what is searched at the middle level
    middle: Patch  # (14, 14) the same averaged
    full: Patch  # (20, 20) what is searched at full resolution
    strip: Patch  # (320,) one column of positions
    surface: Patch  # (17, 17) SSD of the coarse level
    wide_surface: Patch  # (9, 9)
    small: Patch  # (7, 7) SSD of the middle level
    tiny: Patch  # (5, 5) SSD at full resolution
    candidates: Patch  # (3, 3) displacement x, y and score at the middle level


WORKSPACE_SIZE = 3433


@njit(cache=True)
def make_workspace(memory: Patch) -> SsdWorkspace:
    """Lay the parts of a workspace out in flat memory of WORKSPACE_SIZE."""
    return SsdWorkspace(
        memory[:1024].reshape(32, 32),
        memory[1024:1280].reshape(16, 16),
        memory[1280:2064].reshape(28, 28),
        memory[2064:2260].reshape(14, 14),
        memory[2260:2660].reshape(20, 20),
        memory[2660:2980],
        memory[2980:3269].reshape(17, 17),
        memory[3269:3350].reshape(9, 9),
        memory[3350:3399].reshape(7, 7),
        memory[3399:3424].reshape(5, 5),
        memory[3424:3433].reshape(3, 3),
    )


@njit(cache=True)
def make_template(
    image: ImageArray, anchor_x: int, anchor_y: int, memory: Patch, out: SsdTemplate
) -> None:
    """Fill a template from the windows at an anchor; memory is (16, 16)."""
    load_quarter(image, anchor_x, anchor_y, memory)
    halve(memory, out.wide)
    out.coarse[:] = memory[4:12, 4:12]
    load_window(image, anchor_x, anchor_y, out.full)
    halve(out.full, out.middle)


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


# SSD of a template at count × count positions of an area from (corner, corner) on, template and
# window both freed of their mean: Σd² - (Σd)²/n with d = I - T, [Nelson1995] eq. (19). Each column
# of positions is copied to a strip as wide as the template, in which the windows lie one below the
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
def coarse_scores(
    image: ImageArray, anchor_x: int, anchor_y: int, template: SsdTemplate, work: SsdWorkspace
) -> None:
    """Fill work.surface: SSD of the coarse level, of the surroundings, and the cost of distance."""
    load_quarter(image, anchor_x, anchor_y, work.coarse)
    halve(work.coarse, work.wide)
    # The area is 64 px wider than the window that is looked for; the coarse one is 32 px smaller.
    ssd_surface_8(work.coarse, 4, template.coarse, POSITIONS, work.strip, work.surface)
    ssd_surface_8(work.wide, 0, template.wide, WIDE_POSITIONS, work.strip, work.wide_surface)
    middle = POSITIONS // 2
    cost = DISTANCE_COST * SIDE * SIDE / middle**2 * np.var(template.coarse)
    add_surroundings(work.surface, work.wide_surface, float(cost))


@njit(cache=True, fastmath=True)
def add_surroundings(surface: Patch, wide: Patch, cost: float) -> None:
    """Add the wide level's SSD, interpolated, and the cost of distance to the coarse level's."""
    share, one, cost32 = np.float32(WIDE_SHARE / 4.0), np.uint64(1), np.float32(cost)
    for i in range(np.uint64(POSITIONS)):
        above, below, row = wide[i >> one], wide[(i + one) >> one], surface[i]
        away = np.float32(np.int32(i) - POSITIONS // 2)
        for j in range(np.uint64(POSITIONS)):
            left, right = j >> one, (j + one) >> one
            aside = np.float32(np.int32(j) - POSITIONS // 2)
            around = above[left] + above[right] + below[left] + below[right]
            row[j] += share * around + cost32 * (away * away + aside * aside)


@njit(cache=True)
def search(
    image: ImageArray, anchor_x: int, anchor_y: int, template: SsdTemplate, work: SsdWorkspace
) -> tuple[float, float, float]:
    """Find a template within ±32 px of an anchor.

    Returns:
        The displacement x and y of the best window from the anchor, px, with the vertex of a
        parabola as fraction; and its score, grey levels² a pixel summed over the levels.
    """
    coarse_scores(image, anchor_x, anchor_y, template, work)
    entries, middle, first = SIDE * SIDE, POSITIONS // 2, np.inf
    work.candidates[:, 2] = np.inf
    for k in range(CANDIDATES):
        row, column = lowest(work.surface, POSITIONS, POSITIONS)
        score = work.surface[row, column] / entries
        if k > 0 and score > WORTH_FOLLOWING * first:
            break
        first = min(first, score)
        strike_out(work.surface, POSITIONS, POSITIONS, row, column)
        dx, dy = COARSE * (column - middle), COARSE * (row - middle)
        move_x, move_y, value = search_middle(image, anchor_x + dx, anchor_y + dy, template, work)
        found = work.candidates[k]
        found[0], found[1], found[2] = dx + move_x, dy + move_y, score + value / entries
    limit = WORTH_FOLLOWING * work.candidates[:, 2].min()
    best, best_x, best_y = np.inf, 0.0, 0.0
    for k in range(CANDIDATES):
        found = work.candidates[k]
        if found[2] <= limit:
            dx, dy = int(found[0]), int(found[1])
            fine_x, fine_y, value = search_full(image, anchor_x + dx, anchor_y + dy, template, work)
            total = found[2] + value / (4 * entries)
            if total < best:
                best, best_x, best_y = total, dx + fine_x, dy + fine_y
    return best_x, best_y, best


@njit(cache=True)
def search_middle(
    image: ImageArray, anchor_x: int, anchor_y: int, template: SsdTemplate, work: SsdWorkspace
) -> tuple[int, int, float]:
    """Search the middle level around an anchor: displacement x and y in px, and the SSD there."""
    count = 2 * MIDDLE_REACH + 1
    load_window(image, anchor_x, anchor_y, work.window)
    halve(work.window, work.middle)
    ssd_surface_8(work.middle, 0, template.middle, count, work.strip, work.small)
    row, column = lowest(work.small, count, count)
    value = float(work.small[row, column])
    return MIDDLE * (column - MIDDLE_REACH), MIDDLE * (row - MIDDLE_REACH), value


@njit(cache=True)
def search_full(
    image: ImageArray, anchor_x: int, anchor_y: int, template: SsdTemplate, work: SsdWorkspace
) -> tuple[float, float, float]:
    """Search full resolution around an anchor: displacement with fraction, and the SSD there."""
    count, tiny = 2 * FULL_REACH + 1, work.tiny
    load_window(image, anchor_x, anchor_y, work.full)
    ssd_surface_16(work.full, 0, template.full, count, work.strip, tiny)
    row, column = lowest(tiny, count, count)
    x, y = float(column - FULL_REACH), float(row - FULL_REACH)
    if 0 < column < count - 1:
        x += vertex(tiny[row, column - 1], tiny[row, column], tiny[row, column + 1])
    if 0 < row < count - 1:
        y += vertex(tiny[row - 1, column], tiny[row, column], tiny[row + 1, column])
    return x, y, float(tiny[row, column])
