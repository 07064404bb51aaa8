"""The kernel of the SSD tracker: all points from one image to the next, look-alikes told apart."""

import numpy as np
from numba import njit

from vergence.arrays import BoolArray, FloatArray, ImageArray
from vergence.vision.key_templates import PROMISING, nearest, take_over
from vergence.vision.pyramid import anchor_of
from vergence.vision.settled_place import LOST_CORRELATION, correlation_at, settle
from vergence.vision.ssd import (
    SAME_PX,
    WORKSPACE_SIZE,
    make_workspace,
    search,
    template_in,
)
from vergence.vision.ssd_surface import RANGE_PX
from vergence.vision.tracker_state import (
    AT_BORDER,
    COLUMNS,
    CORRELATION,
    COVARIANCE,
    DETAIL,
    FOUND,
    LEFT,
    NO_TEMPLATE,
    RESIDUAL,
    VERDICT,
    TrackerState,
    twins_of,
)
from vergence.vision.two_by_two import apply2, inverse2

MOST_PLACES = 32  # candidate positions of a point: search, expected, neighbours' motion, twins
ALIKE = 0.05  # positions whose correlation is within this of the search's are look-alikes
POSSIBLE = 0.1  # if the point has look-alikes in the first image, one of which may be found
UNCHANGED = 0.995  # correlation beyond which it is the point itself, as it was
NEIGHBOURS = 5  # points whose motion decides between look-alikes
AT_BORDER_PX = 20.0  # a point lost when expected this close to the border has probably left
CONSENSUS = 3  # points found that predict where the others may have moved
DECIDED = 0.5  # of the next one's: distance at which the neighbours' motion decides
LOOK_AGAIN_PX = 6.0  # if they moved at least this far


@njit(cache=True)
def track_points(image: ImageArray, state: TrackerState, answers: FloatArray) -> bool:
    """Find all points, each expected at answers[k, PLACE]; return whether all were found."""
    expected, count = answers[:, :2].copy(), len(answers)
    places = np.empty((count, MOST_PLACES, COLUMNS + 4))
    possible, sure = np.zeros(count, dtype=np.int64), np.zeros(count, dtype=np.bool_)
    for k in range(count):
        out = answers[k]
        out[RESIDUAL], out[CORRELATION], out[DETAIL] = np.nan, np.nan, np.nan
        out[VERDICT] = NO_TEMPLATE
        if state.keys[k, 0] > 0:
            possible[k] = those_alike(
                k, state, places[k], settle_all(image, k, state, out, places[k])
            )
            sure[k] = (
                out[VERDICT] == FOUND and np.sum(that_look_alike(places[k, : possible[k]])) < 2
            )
    found = answers[:, VERDICT] == FOUND
    for k in range(count):
        if not found[k]:
            continue
        chosen = 0
        if possible[k] > 1:
            x, y = where_neighbours_go(k, expected, answers, sure)
            # The search may not have found it.
            least = worth_finding(k, state, places[k])
            settle(image, x, y, k, state, least, places[k, possible[k]])
            possible[k] = those_alike(k, state, places[k], possible[k] + 1)
            others = places[k, : possible[k]]
            off = np.hypot(others[:, 0] - x, others[:, 1] - y)
            chosen = int(np.argmin(np.where(that_look_alike(others), off, np.inf)))
            near = off[chosen]
            off[chosen] = np.inf
            if np.sum(sure) < CONSENSUS or (possible[k] > 1 and near > DECIDED * off.min()):
                widen_for_others(others, chosen)
        answers[k] = places[k, chosen, :COLUMNS]
        take_over(image, k, state, places[k, chosen])
    if CONSENSUS <= np.sum(found) < count:
        look_again(image, state, expected, answers)
    complete = True
    for out in answers:
        if out[VERDICT] != FOUND:
            complete = False
            out[2], out[5] = RANGE_PX * RANGE_PX / 3.0, RANGE_PX * RANGE_PX / 3.0
            out[3], out[4] = 0.0, 0.0
    return complete


@njit(cache=True, inline="always")
def look_again(
    image: ImageArray, state: TrackerState, expected: FloatArray, answers: FloatArray
) -> None:
    """Search again for the points not found, at positions from the others' median motion."""
    found = answers[:, VERDICT] == FOUND
    moved = answers[:, :2] - expected
    dx, dy = np.median(moved[found, 0]), np.median(moved[found, 1])
    if dx * dx + dy * dy < LOOK_AGAIN_PX * LOOK_AGAIN_PX:
        return
    for k in range(len(answers)):
        if not found[k] and state.keys[k, 0] > 0:
            before = answers[k].copy()
            answers[k, 0], answers[k, 1] = expected[k, 0] + dx, expected[k, 1] + dy
            answers[k, VERDICT] = track_point(image, k, state, answers[k])
            if answers[k, VERDICT] != FOUND:
                answers[k] = before


@njit(cache=True, inline="always")
def track_point(image: ImageArray, k: int, state: TrackerState, out: FloatArray) -> int:
    """Find point k alone, expected at out[PLACE], in an image; return the verdict."""
    places = np.empty((MOST_PLACES, COLUMNS + 4))
    alike = those_alike(k, state, places, settle_all(image, k, state, out, places))
    if out[VERDICT] == FOUND:
        widen_for_others(places[:alike], 0)
        out[:] = places[0, :COLUMNS]
        take_over(image, k, state, places[0])
    return int(out[VERDICT])


@njit(cache=True)
def settle_all(
    image: ImageArray, k: int, state: TrackerState, out: FloatArray, places: FloatArray
) -> int:
    """Align point k, expected at out[PLACE], at all its candidate positions; return their number.

    Marks may look alike, so apart from the search's best position, its other candidates and the
    expected position are aligned if they are promising, as are the present positions of marks near
    the point that look like it in the first image. If the point is not at the search's best, only
    the expected position is tried, and the reason is that of the search's best.

    Args:
        image: grey, (height, width).
        k: index of the point.
        state: of the tracker; not changed.
        out: set to the result at the first position where the point is found.
        places: set to that position and then the others, (MOST_PLACES, COLUMNS + 4): columns as in
            out, and the affine matrix from the first image to this one.
    """
    height, width = image.shape
    x, y = out[0], out[1]
    out[VERDICT] = LEFT
    if not (-RANGE_PX <= x < width + RANGE_PX and -RANGE_PX <= y < height + RANGE_PX):
        return 0
    starts, count = starting_places(image, k, state, x, y), 0
    last = len(starts) - 1
    for n in range(len(starts)):
        start_x, start_y = starts[n, 0], starts[n, 1]
        if nearest(starts[:n], start_x, start_y) < SAME_PX:
            continue
        if count == 0:
            promising = n == 0 or n == last
        else:
            promising = correlation_at(image, start_x, start_y, k, state) >= PROMISING
        if promising:
            least = worth_finding(k, state, places) if count else -1.0
            settle(image, start_x, start_y, k, state, least, places[count])
            if n == 0:
                out[2:] = places[0, 2:COLUMNS]
            count += places[count, VERDICT] == FOUND
    if count == 0:
        border = min(x + 0.5, y + 0.5, width - 0.5 - x, height - 0.5 - y)
        if border < AT_BORDER_PX:
            out[VERDICT], out[DETAIL] = AT_BORDER, max(border, 0.0)
        return 0
    out[:] = places[0, :COLUMNS]
    for twin in twins_of(state, k):  # the position may be the twin's, and the twin's its twin's
        away = apply2(places[0, COLUMNS:].reshape(2, 2), twin)
        for sign in (1.0, -1.0):
            start_x, start_y = places[0, 0] + sign * away[0], places[0, 1] + sign * away[1]
            if nearest(places[:count, :2], start_x, start_y) < SAME_PX:
                continue
            least = worth_finding(k, state, places)
            settle(image, start_x, start_y, k, state, least, places[count])
            count += places[count, VERDICT] == FOUND
    return count


@njit(cache=True, inline="always")
def starting_places(
    image: ImageArray, k: int, state: TrackerState, x: float, y: float
) -> FloatArray:
    """Return initial positions of point k, (N, 2): the search's best first, (x, y) last."""
    offset_x, offset_y = state.places[k, 6], state.places[k, 7]
    anchor_x, anchor_y = anchor_of(x - offset_x), anchor_of(y - offset_y)
    work = make_workspace(state.memory[:WORKSPACE_SIZE])
    count = search(image, anchor_x, anchor_y, template_in(state.search[k]), work)
    places = np.empty((count + 1, 2))
    places[:count] = work.candidates[:count, :2]
    places[:count, 0] += anchor_x - 0.5 + offset_x
    places[:count, 1] += anchor_y - 0.5 + offset_y
    places[count, 0], places[count, 1] = x, y
    return places


@njit(cache=True, inline="always")
def worth_finding(k: int, state: TrackerState, places: FloatArray) -> float:
    """Smallest correlation with which another position may be point k, beside the first one."""
    correlation = places[0, CORRELATION]
    changed = correlation < UNCHANGED and np.any(twins_of(state, k)[0] != 0.0)
    least: float = max(correlation - (POSSIBLE if changed else ALIKE), LOST_CORRELATION)
    return least


@njit(cache=True, inline="always")
def those_alike(k: int, state: TrackerState, places: FloatArray, count: int) -> int:
    """Move the positions that may be point k, beside the best, to the front; return how many.

    If the first one is the best by a margin, it is the only one.
    """
    alike, least = min(count, 1), worth_finding(k, state, places)
    for n in range(1, count):
        if places[n, VERDICT] == FOUND and places[n, CORRELATION] > least:
            places[alike] = places[n].copy()
            alike += 1
    return alike


@njit(cache=True, inline="always")
def that_look_alike(places: FloatArray) -> BoolArray:
    """Return which positions match about as well as the first, itself included."""
    alike: BoolArray = places[:, CORRELATION] > places[0, CORRELATION] - ALIKE
    return alike


@njit(cache=True, inline="always")
def where_neighbours_go(
    k: int, expected: FloatArray, answers: FloatArray, sure: BoolArray
) -> tuple[float, float]:
    """Return point k's position if it moved like the nearest certain points, else as expected."""
    others = np.flatnonzero(sure)
    if len(others) < CONSENSUS:
        return expected[k, 0], expected[k, 1]
    off = np.hypot(expected[others, 0] - expected[k, 0], expected[others, 1] - expected[k, 1])
    near = others[np.argsort(off)[:NEIGHBOURS]]
    moved = answers[near, :2] - expected[near]
    return expected[k, 0] + np.median(moved[:, 0]), expected[k, 1] + np.median(moved[:, 1])


@njit(cache=True, inline="always")
def widen_for_others(places: FloatArray, chosen: int) -> None:
    """Widen the covariance of the chosen position so that each other lies within one deviation.

    It grows along the difference d, C ← C + (1 − 1/dᵀC⁻¹d) d dᵀ, after which dᵀC⁻¹d = 1: positions
    along an edge leave it narrow across.
    """
    C = places[chosen, COVARIANCE].reshape(2, 2)
    for n in range(len(places)):
        d = places[n, :2] - places[chosen, :2]
        square = np.sum(d * apply2(inverse2(C), d))
        if square > 1.0:
            for i in range(2):
                for j in range(2):
                    C[i, j] += (1.0 - 1.0 / square) * d[i] * d[j]
