"""The search of [Nelson1995] section 2.3: the displacement that minimises the SSD, eq. (19).

Coarse, middle and full resolution, on windows of the image alone. It departs from the paper in ways
that make the search succeed more often: the means of template and window are subtracted, so that a
change of brightness has no effect; a level of half the coarse resolution and twice its window is
added to the coarse level, so that one of many equal marks is identified by its surroundings; if
several minima of the coarse level are close to the best, all are followed to full resolution and
compared there; a far window must match slightly better than a near one.

Kernels that only kernels call are inlined: numba would compile each again, with all its callees.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from vergence.arrays import ImageArray
from vergence.vision.pyramid import Patch, halve, load_quarter, load_window
from vergence.vision.ssd_surface import (
    RANGE_PX,
    SIDE,
    STRUCK_OUT,
    lowest,
    ssd_surface_8,
    ssd_surface_16,
    strike_out,
    vertex,
)

COARSE, MIDDLE = 4, 2  # pixels averaged along each axis
POSITIONS = 2 * RANGE_PX // COARSE + 1  # along each axis of the coarse level
WIDE_POSITIONS = RANGE_PX // COARSE + 1
MINIMA = 48  # largest number of coarse minima that are followed: a pattern may have so many
CANDIDATES = 6  # of these, the best are returned
MIDDLE_REACH = 3  # search distance around each of them in middle pixels
FULL_REACH = 2  # search distance around the middle minimum in pixels
WIDE_SHARE = 1.0  # weight of the surroundings relative to the coarse template
DISTANCE_COST = 0.6  # at 32 px, in units of the template's variance
FEW = 5  # minima that are followed, good or not
GOOD = 0.5  # of the average position's SSD: minima beyond those few that are followed
WORTH_FOLLOWING = 2.0  # multiples of the lowest: minima that are followed
SAME_PX = 2.0  # closer positions are the same: the alignment converges to the same


class SsdTemplate(NamedTuple):
    """The template of the search: one window at four resolutions, all with the same centre."""

    wide: Patch  # (8, 8) 64 × 64 px averaged
    coarse: Patch  # (8, 8) 32 × 32 px averaged
    middle: Patch  # (8, 8) 16 × 16 px averaged
    full: Patch  # (16, 16)


TEMPLATE_SIZE = 3 * 8 * 8 + 16 * 16


@njit(cache=True, inline="always")
def template_in(memory: Patch) -> SsdTemplate:
    """Lay a template out in flat memory of TEMPLATE_SIZE."""
    return SsdTemplate(
        memory[:64].reshape(8, 8),
        memory[64:128].reshape(8, 8),
        memory[128:192].reshape(8, 8),
        memory[192:].reshape(16, 16),
    )


class SsdWorkspace(NamedTuple):
    """Work memory of the search, so that it allocates none."""

    coarse: Patch  # (32, 32) 128 × 128 px around the anchor, averaged
    wide: Patch  # (16, 16) the same at half that resolution
    window: Patch  # (28, 28) search window of the middle level
    middle: Patch  # (14, 14) the same averaged
    full: Patch  # (20, 20) search window at full resolution
    strip: Patch  # (320,) one column of positions
    surface: Patch  # (17, 17) SSD of the coarse level
    wide_surface: Patch  # (9, 9)
    small: Patch  # (7, 7) SSD of the middle level
    tiny: Patch  # (5, 5) SSD at full resolution
    candidates: Patch  # (49, 3) of the minima followed: displacement x, y; SSD over all levels


WORKSPACE_SIZE = 3571


@njit(cache=True, inline="always")
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
        memory[3424:3571].reshape(49, 3),
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


@njit(cache=True, inline="always")
def coarse_scores(
    image: ImageArray, anchor_x: int, anchor_y: int, template: SsdTemplate, work: SsdWorkspace
) -> None:
    """Fill work.surface: SSD of the coarse level, of the surroundings, and the distance penalty."""
    load_quarter(image, anchor_x, anchor_y, work.coarse)
    halve(work.coarse, work.wide)
    # The area is 64 px wider than the window that is searched for; the coarse one is 32 px smaller.
    ssd_surface_8(work.coarse, 4, template.coarse, POSITIONS, work.strip, work.surface)
    ssd_surface_8(work.wide, 0, template.wide, WIDE_POSITIONS, work.strip, work.wide_surface)
    cost = SIDE * SIDE * COARSE * COARSE * distance_cost(template)
    add_surroundings(work.surface, work.wide_surface, cost)


@njit(cache=True, inline="always")
def distance_cost(template: SsdTemplate) -> float:
    """Return the penalty for the distance from the expected position, grey levels² per px²."""
    return float(DISTANCE_COST / RANGE_PX**2 * np.var(template.coarse))


@njit(cache=True, fastmath=True)
def add_surroundings(surface: Patch, wide: Patch, cost: float) -> None:
    """Add the wide level's SSD, interpolated, and the distance penalty to the coarse level's."""
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
) -> int:
    """Find a template within ±32 px of an anchor.

    Of several candidates the best are those with the lowest SSD over all levels at their exact
    positions: small marks cannot be compared on the grid of the coarse level.

    Returns:
        The number of candidates. work.candidates contains their displacements x and y from the
        anchor, px, interpolated by a parabola; the best first.
    """
    count = follow_minima(image, anchor_x, anchor_y, template, work)
    for k in range(count):
        found = work.candidates[k]
        x, y = anchor_x + int(found[0]), anchor_y + int(found[1])
        fine_x, fine_y, score = search_full(image, x, y, template, work)
        found[0] += fine_x
        found[1] += fine_y
        if count > 1:
            x, y = anchor_x + int(np.rint(found[0])), anchor_y + int(np.rint(found[1]))
            score += surroundings(image, x, y, template, work)
            score += distance_cost(template) * (found[0] ** 2 + found[1] ** 2)
        found[2] = score
    return best_first(work.candidates[:count], CANDIDATES)


@njit(cache=True, inline="always")
def best_first(candidates: Patch, most: int) -> int:
    """Move the candidates (N, 3) with the lowest scores to the front; return how many differ.

    Of those that reached the same position only one counts.
    """
    count = 0
    while count < min(len(candidates), most):
        best = count + int(np.argmin(candidates[count:, 2]))
        if candidates[best, 2] == np.float32(STRUCK_OUT):
            break
        for column in range(3):
            here = candidates[count, column]
            candidates[count, column] = candidates[best, column]
            candidates[best, column] = here
        chosen = candidates[count]
        count += 1
        for other in candidates[count:]:
            if (other[0] - chosen[0]) ** 2 + (other[1] - chosen[1]) ** 2 < SAME_PX * SAME_PX:
                other[2] = np.float32(STRUCK_OUT)
    return count


@njit(cache=True, inline="always")
def follow_minima(
    image: ImageArray, anchor_x: int, anchor_y: int, template: SsdTemplate, work: SsdWorkspace
) -> int:
    """Follow the best minima of the coarse level, and that of the surroundings; return how many."""
    coarse_scores(image, anchor_x, anchor_y, template, work)
    around_y, around_x = lowest(work.wide_surface, WIDE_POSITIONS, WIDE_POSITIONS)
    count, limit, good = 0, np.inf, GOOD * np.mean(work.surface)
    while count < MINIMA:
        row, column = lowest(work.surface, POSITIONS, POSITIONS)
        if work.surface[row, column] > limit:
            break
        limit = min(limit, WORTH_FOLLOWING * work.surface[row, column])
        if count == FEW:
            limit = min(limit, good)
        follow(image, anchor_x, anchor_y, row, column, template, work, count)
        count += 1
    if work.surface[2 * around_y, 2 * around_x] <= limit:
        follow(image, anchor_x, anchor_y, 2 * around_y, 2 * around_x, template, work, count)
        count += 1
    return count


@njit(cache=True, inline="always")
def follow(
    image: ImageArray,
    anchor_x: int,
    anchor_y: int,
    row: int,
    column: int,
    template: SsdTemplate,
    work: SsdWorkspace,
    k: int,
) -> None:
    """Store a position of the coarse level, refined at the middle level, as candidate k."""
    strike_out(work.surface, POSITIONS, POSITIONS, row, column)
    dx, dy = COARSE * (column - POSITIONS // 2), COARSE * (row - POSITIONS // 2)
    move_x, move_y = search_middle(image, anchor_x + dx, anchor_y + dy, template, work)
    work.candidates[k, 0], work.candidates[k, 1] = dx + move_x, dy + move_y


@njit(cache=True, inline="always")
def first_entries(memory: Patch, side: int) -> Patch:
    """Return the first elements of memory as a contiguous square, (side, side)."""
    return memory.reshape(memory.size)[: side * side].reshape(side, side)


@njit(cache=True, inline="always")
def surroundings(
    image: ImageArray, anchor_x: int, anchor_y: int, template: SsdTemplate, work: SsdWorkspace
) -> float:
    """Return the SSD of coarse template and surroundings at an anchor, grey levels² per sample."""
    area, around = first_entries(work.window, 16), first_entries(work.middle, 8)
    load_quarter(image, anchor_x, anchor_y, area)
    halve(area, around)
    ssd_surface_8(area, 4, template.coarse, 1, work.strip, work.tiny)
    coarse = work.tiny[0, 0]
    ssd_surface_8(around, 0, template.wide, 1, work.strip, work.tiny)
    return float(coarse + WIDE_SHARE * work.tiny[0, 0]) / (SIDE * SIDE)


@njit(cache=True, inline="always")
def search_middle(
    image: ImageArray, anchor_x: int, anchor_y: int, template: SsdTemplate, work: SsdWorkspace
) -> tuple[int, int]:
    """Search the middle level around an anchor; return displacement x and y in px."""
    count = 2 * MIDDLE_REACH + 1
    load_window(image, anchor_x, anchor_y, work.window)
    halve(work.window, work.middle)
    ssd_surface_8(work.middle, 0, template.middle, count, work.strip, work.small)
    row, column = lowest(work.small, count, count)
    return MIDDLE * (column - MIDDLE_REACH), MIDDLE * (row - MIDDLE_REACH)


@njit(cache=True, inline="always")
def search_full(
    image: ImageArray, anchor_x: int, anchor_y: int, template: SsdTemplate, work: SsdWorkspace
) -> tuple[float, float, float]:
    """Search full resolution around an anchor; return displacement and SSD per sample."""
    count, tiny = 2 * FULL_REACH + 1, work.tiny
    load_window(image, anchor_x, anchor_y, work.full)
    ssd_surface_16(work.full, 0, template.full, count, work.strip, tiny)
    row, column = lowest(tiny, count, count)
    x, y = float(column - FULL_REACH), float(row - FULL_REACH)
    if 0 < column < count - 1:
        x += vertex(tiny[row, column - 1], tiny[row, column], tiny[row, column + 1])
    if 0 < row < count - 1:
        y += vertex(tiny[row - 1, column], tiny[row, column], tiny[row + 1, column])
    return x, y, float(tiny[row, column]) / (4 * SIDE * SIDE)
