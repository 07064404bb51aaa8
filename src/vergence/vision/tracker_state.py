"""The state of the SSD tracker, and the kernel that updates it from one image to the next.

Two templates serve two purposes. The search, which must not miss, uses the window of the last image
in which the point was found, as [Nelson1995] eq. (19) compares successive images. The position,
which must not drift, comes from an affine alignment to a key template that is kept as long as the
measured change of form since it was taken is small; the point's sub-pixel offset is kept with it.

Kernels that only kernels call are inlined: numba would compile each again, with all its callees.
"""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from vergence.arrays import BoolArray, FloatArray, ImageArray, IntArray
from vergence.vision.alignment import (
    AREA_PX,
    FORM_PRIOR,
    FREE,
    PATCH_PX,
    RESAMPLING_SIZE,
    RIGID,
    ROOT_WEIGHTS,
    UNKNOWNS,
    Alignment,
    AlignmentTemplate,
    agreement,
    align,
    fill_template,
    make_resampling,
    resample,
)
from vergence.vision.pyramid import Patch, anchor_of, load_window
from vergence.vision.ssd import (
    RANGE_PX,
    TEMPLATE_SIZE,
    WORKSPACE_SIZE,
    make_template,
    make_workspace,
    search,
    template_in,
)

KEYS = 16  # key templates kept for each point
REFRESH_STRETCH = 1.2  # a new key template when any direction has stretched or shrunk by this
REFRESH_CORRELATION = 0.85  # and the old one is still recognised this well
LOST_CORRELATION = 0.75
LOST_SHIFT_PX = 4.0  # search and alignment must agree within this
SAME_PX = 2.0  # closer positions are the same: the alignment converges to the same
PROMISING = 0.3  # smallest correlation before an alignment that makes it worthwhile
MOST_PLACES = 12  # candidate positions of a point: search, expected, neighbours' motion, twins
TWINS = 2  # nearest look-alikes of a point that are stored
TWIN_RANGE_PX = 16.0  # within which they are searched for in the first image
TWIN_STEP_PX = 3.0  # and step of that search: an alignment started this close converges
ALIKE = 0.05  # positions whose correlation is within this of the search's are look-alikes
NEIGHBOURS = 5  # points whose motion decides between look-alikes
LOST_STRETCH = 1.6  # no patch changes form by more between two images
GAIN_RANGE = (0.25, 4.0)  # contrast against the key template
AT_BORDER_PX = 20.0  # a point lost when expected this close to the border has probably left
FIT_PX = 8.0  # smallest distance from the border: half of the 16 × 16 window
CONSENSUS = 3  # points found that predict where the others may have moved
LOOK_AGAIN_PX = 6.0  # if they moved at least this far
_WEIGHTS = ROOT_WEIGHTS.astype(np.float64) ** 2
# Information from noise alone, px⁻², over its variance. A central difference has half the variance
# of a pixel; half of the residual's is the template's; doubled for safety.
NOISE_GRADIENT = float(0.5 * _WEIGHTS.sum() ** 2 / (_WEIGHTS**2).sum())
EDGE = 0.15  # of the information across: less along it may come from the pixel grid
TURNED = 0.06  # rad, standard deviation of a patch's direction along an edge
FLOOR_PX = 0.01  # lower bound on the standard deviation: interpolation, quantised grey levels

FOUND, LEFT, NO_MATCH, DISAGREES, DEFORMED, CONTRAST, NO_TEMPLATE, AT_BORDER = range(8)


class TrackerState(NamedTuple):
    """The state of the tracker for M points with up to K key templates each.

    In few arrays, since each costs 0.2 µs per call from Python; the functions below access the
    parts.
    """

    places: FloatArray  # (M, 12) px where last found; affine 2 × 2 from first image to last; search
    # offset: point less centre of the search template, px; offsets of its twins, first image, px
    search: Patch  # (M, 448) search template
    jacobian: Patch  # (M, K, 8, n) of the key templates
    inverse: FloatArray  # (M, K, 2, 8, 8) of the key templates
    facts: FloatArray  # (M, K, 16) of the key templates: 4 of the alignment; affine 2 × 2 from the
    # first image to the template's; covariance 2 × 2 of the point's place in it, px²; spread 2 × 2
    keys: IntArray  # (M, 2) number of key templates, and index of the one in use
    memory: Patch  # work memory of the kernels
    corner: NDArray[np.int32]  # work memory of the kernels


# Columns of the kernel's result for each point.
PLACE, COVARIANCE = slice(0, 2), slice(2, 6)  # px, px²
RESIDUAL, CORRELATION, DETAIL, VERDICT = 6, 7, 8, 9  # detail: the number behind the verdict
COLUMNS = 10


def empty_state(count: int) -> TrackerState:
    """Allocate the memory for a number of points."""
    n, f4 = PATCH_PX * PATCH_PX, np.float32
    places = np.zeros((count, 8 + 2 * TWINS))
    places[:, 2:6] = np.eye(2).ravel()
    return TrackerState(
        places,
        np.zeros((count, TEMPLATE_SIZE), f4),
        np.zeros((count, KEYS, UNKNOWNS, n), f4),
        np.zeros((count, KEYS, 2, UNKNOWNS, UNKNOWNS)),
        np.zeros((count, KEYS, 16)),
        np.zeros((count, 2), np.int64),
        np.zeros(WORKSPACE_SIZE + RESAMPLING_SIZE, f4),
        np.zeros(PATCH_PX, np.int32),
    )


@njit(cache=True, inline="always")
def affine_of(state: TrackerState, k: int) -> FloatArray:
    """Affine matrix of point k from the first image to the last, (2, 2)."""
    return state.places[k, 2:6].reshape(2, 2)


@njit(cache=True, inline="always")
def key_affine_of(state: TrackerState, k: int, key: int) -> FloatArray:
    """Affine matrix of point k from the first image to that of a key template, (2, 2)."""
    return state.facts[k, key, 4:8].reshape(2, 2)


@njit(cache=True, inline="always")
def key_covariance_of(state: TrackerState, k: int, key: int) -> FloatArray:
    """Covariance of the place of point k in a key template, (2, 2) px²."""
    return state.facts[k, key, 8:12].reshape(2, 2)


@njit(cache=True, inline="always")
def key_template_of(state: TrackerState, k: int, key: int) -> AlignmentTemplate:
    """Key template of point k."""
    facts = state.facts[k, key]
    return AlignmentTemplate(
        state.jacobian[k, key], state.inverse[k, key], facts[:4], facts[12:].reshape(2, 2)
    )


@njit(cache=True, inline="always")
def fits(x: float, y: float, width: int, height: int) -> bool:
    """Whether the 16 × 16 window around a point lies in the image."""
    return FIT_PX - 0.5 <= x <= width - FIT_PX - 0.5 and FIT_PX - 0.5 <= y <= height - FIT_PX - 0.5


@njit(cache=True, inline="always")
def inverse2(A: FloatArray) -> FloatArray:
    """Inverse of a 2 × 2 matrix."""
    determinant = A[0, 0] * A[1, 1] - A[0, 1] * A[1, 0]
    out = np.empty((2, 2))
    out[0, 0], out[0, 1] = A[1, 1] / determinant, -A[0, 1] / determinant
    out[1, 0], out[1, 1] = -A[1, 0] / determinant, A[0, 0] / determinant
    return out


@njit(cache=True, inline="always")
def product2(A: FloatArray, B: FloatArray) -> FloatArray:
    """A B for 2 × 2 matrices."""
    out = np.empty((2, 2))
    for i in range(2):
        for j in range(2):
            out[i, j] = A[i, 0] * B[0, j] + A[i, 1] * B[1, j]
    return out


@njit(cache=True, inline="always")
def apply2(A: FloatArray, x: FloatArray) -> FloatArray:
    """A x for a 2 × 2 matrix."""
    out = np.empty(2)
    out[0], out[1] = A[0, 0] * x[0] + A[0, 1] * x[1], A[1, 0] * x[0] + A[1, 1] * x[1]
    return out


@njit(cache=True, inline="always")
def stretch(A: FloatArray) -> float:
    """The larger of σ₁ and 1/σ₂ of a 2 × 2 matrix: 1 for a rotation."""
    total = 0.5 * (A[0, 0] ** 2 + A[0, 1] ** 2 + A[1, 0] ** 2 + A[1, 1] ** 2)
    determinant = abs(A[0, 0] * A[1, 1] - A[0, 1] * A[1, 0])
    root = np.sqrt(max(total * total - determinant * determinant, 0.0))
    largest = np.sqrt(total + root)
    return float(max(largest, largest / max(determinant, 1e-12)))


@njit(cache=True, inline="always")
def add_key(image: ImageArray, state: TrackerState, k: int, covariance: FloatArray) -> None:
    """Store a new key template of point k at its position; replaces the newest if full."""
    key = min(state.keys[k, 0], KEYS - 1)
    x, y = state.places[k, 0], state.places[k, 1]
    fill_template(image, anchor_of(x), anchor_of(y), x, y, key_template_of(state, k, key))
    key_affine_of(state, k, key)[:] = affine_of(state, k)
    key_covariance_of(state, k, key)[:] = covariance
    state.keys[k, 0], state.keys[k, 1] = key + 1, key


@njit(cache=True, inline="always")
def renew_search(image: ImageArray, state: TrackerState, k: int) -> None:
    """Use the window at point k as the next search template."""
    x, y = state.places[k, 0], state.places[k, 1]
    anchor_x, anchor_y = anchor_of(x), anchor_of(y)
    memory = state.memory[:256].reshape(16, 16)
    make_template(image, anchor_x, anchor_y, memory, template_in(state.search[k]))
    state.places[k, 6], state.places[k, 7] = x - (anchor_x - 0.5), y - (anchor_y - 0.5)


@njit(cache=True)
def start_points(image: ImageArray, state: TrackerState) -> None:
    """Create the first templates of all points whose window fits into the image."""
    height, width = image.shape
    for k in range(len(state.places)):
        if fits(state.places[k, 0], state.places[k, 1], width, height):
            add_key(image, state, k, np.zeros((2, 2)))
            renew_search(image, state, k)
            remember_twins(image, k, state)


@njit(cache=True, inline="always")
def twins_of(state: TrackerState, k: int) -> FloatArray:
    """Offsets of the positions in the first image that look like point k, (TWINS, 2), 0 if none."""
    return state.places[k, 8:].reshape(TWINS, 2)


@njit(cache=True, inline="always")
def remember_twins(image: ImageArray, k: int, state: TrackerState) -> None:
    """Find the nearest positions in the first image that could be confused with point k."""
    twins, place = twins_of(state, k), np.empty(COLUMNS + 4)
    x, y = state.places[k, 0], state.places[k, 1]
    distances = np.full(TWINS, np.inf)
    steps = int(TWIN_RANGE_PX / TWIN_STEP_PX)
    for i in range(-steps, steps + 1):
        for j in range(-steps, steps + 1):
            start_x, start_y = x + TWIN_STEP_PX * i, y + TWIN_STEP_PX * j
            if correlation_at(image, start_x, start_y, k, state) < PROMISING:
                continue
            settle(image, start_x, start_y, k, state, place)
            off_x, off_y = place[0] - x, place[1] - y
            distance, last = np.hypot(off_x, off_y), np.argmax(distances)
            if place[VERDICT] != FOUND or not SAME_PX < distance < distances[last]:
                continue
            if nearest(twins, off_x, off_y) >= SAME_PX:
                twins[last, 0], twins[last, 1], distances[last] = off_x, off_y, distance


@njit(cache=True, inline="always")
def choose_key(image: ImageArray, state: TrackerState, k: int, covariance: FloatArray) -> None:
    """Keep the key template, return to an older one of similar form, or take a new one.

    Returning to an older one undoes the drift of the newer ones.
    """
    active, nearest, best = state.keys[k, 1], np.inf, state.keys[k, 1]
    affine = affine_of(state, k)
    if stretch(product2(affine, inverse2(key_affine_of(state, k, active)))) <= REFRESH_STRETCH:
        return
    for key in range(state.keys[k, 0]):
        change = stretch(product2(affine, inverse2(key_affine_of(state, k, key))))
        if change < nearest:
            best, nearest = key, change
    if nearest <= REFRESH_STRETCH:
        state.keys[k, 1] = best
    else:
        add_key(image, state, k, covariance)


@njit(cache=True, inline="always")
def judge(found: Alignment, shift: float, change: float) -> tuple[int, float]:
    """Return whether an alignment is the point: the verdict and its number."""
    if found.correlation < LOST_CORRELATION:
        return NO_MATCH, found.correlation
    if not GAIN_RANGE[0] <= found.gain <= GAIN_RANGE[1]:
        return CONTRAST, found.gain
    if shift > LOST_SHIFT_PX:
        return DISAGREES, shift
    if change > LOST_STRETCH:
        return DEFORMED, change
    return FOUND, found.correlation


@njit(cache=True, inline="always")
def track_point(image: ImageArray, k: int, state: TrackerState, out: FloatArray) -> int:
    """Find point k alone, expected at out[PLACE], in an image; return the verdict."""
    places = np.empty((MOST_PLACES, COLUMNS + 4))
    settle_all(image, k, state, out, places)
    if out[VERDICT] == FOUND:
        take_over(image, k, state, places[0])
    return int(out[VERDICT])


@njit(cache=True)
def settle_all(
    image: ImageArray, k: int, state: TrackerState, out: FloatArray, places: FloatArray
) -> int:
    """Align point k, expected at out[PLACE], at all its candidate positions; return their number.

    Marks may look alike, so apart from the search's best position, its other candidates and the
    expected position are aligned if they are promising, as are the present positions of marks near
    the point that look like it in the first image.

    Args:
        image: grey, (height, width).
        k: index of the point.
        state: of the tracker; not changed.
        out: set to the result at the search's position; if the point is not there, at the expected
            one.
        places: set to that position and then the others, (MOST_PLACES, COLUMNS + 4): columns as in
            out, and the affine matrix from the first image to this one.
    """
    height, width = image.shape
    x, y = out[0], out[1]
    out[VERDICT] = LEFT
    if not (-RANGE_PX <= x < width + RANGE_PX and -RANGE_PX <= y < height + RANGE_PX):
        return 0
    starts = starting_places(image, k, state, x, y)
    places[0, :COLUMNS] = out
    settle(image, starts[0, 0], starts[0, 1], k, state, places[0])
    if places[0, VERDICT] != FOUND:
        out[:] = places[0, :COLUMNS]
        settle(image, x, y, k, state, places[0])
        if places[0, VERDICT] == FOUND:
            out[:] = places[0, :COLUMNS]
            return 1
        border = min(x + 0.5, y + 0.5, width - 0.5 - x, height - 0.5 - y)
        if border < AT_BORDER_PX:
            out[VERDICT], out[DETAIL] = AT_BORDER, max(border, 0.0)
        return 0
    out[:] = places[0, :COLUMNS]
    count = 1
    for n in range(1, len(starts)):
        start_x, start_y = starts[n, 0], starts[n, 1]
        if nearest(starts[:n], start_x, start_y) < SAME_PX:
            continue
        if correlation_at(image, start_x, start_y, k, state) >= PROMISING:
            settle(image, start_x, start_y, k, state, places[count])
            count += places[count, VERDICT] == FOUND
    for twin in twins_of(state, k):  # the position may be the twin's, and the twin's its twin's
        away = apply2(places[0, COLUMNS:].reshape(2, 2), twin)
        for sign in (1.0, -1.0):
            start_x, start_y = places[0, 0] + sign * away[0], places[0, 1] + sign * away[1]
            if nearest(places[:count, :2], start_x, start_y) >= SAME_PX:
                settle(image, start_x, start_y, k, state, places[count])
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
    count, best = search(image, anchor_x, anchor_y, template_in(state.search[k]), work)
    places = np.empty((count + 1, 2))
    places[:count] = work.candidates[:count]
    places[0], places[best] = work.candidates[best], work.candidates[0]
    places[:count, 0] += anchor_x - 0.5 + offset_x
    places[:count, 1] += anchor_y - 0.5 + offset_y
    places[count, 0], places[count, 1] = x, y
    return places


@njit(cache=True, inline="always")
def nearest(places: FloatArray, x: float, y: float) -> float:
    """Distance from (x, y) to the nearest of some positions (N, 2)."""
    least = np.inf
    for n in range(len(places)):
        least = min(least, np.hypot(places[n, 0] - x, places[n, 1] - y))
    return least


@njit(cache=True)
def correlation_at(image: ImageArray, x: float, y: float, k: int, state: TrackerState) -> float:
    """Correlation of the key template of point k with a position, without alignment."""
    work = make_resampling(state.memory[WORKSPACE_SIZE:], state.corner)
    corner_x, corner_y = anchor_of(x) - AREA_PX // 2, anchor_of(y) - AREA_PX // 2
    load_window(image, anchor_of(x), anchor_of(y), work.area)
    key = state.keys[k, 1]
    before = product2(affine_of(state, k), inverse2(key_affine_of(state, k, key)))
    template = key_template_of(state, k, key)
    resample(x - corner_x, y - corner_y, before, template, work)
    correlation, _ = agreement(template, work)
    return correlation


@njit(cache=True)
def settle(
    image: ImageArray, x: float, y: float, k: int, state: TrackerState, out: FloatArray
) -> None:
    """Align point k from a start and judge whether it is the point; fills out, (COLUMNS + 4,).

    Position, covariance and affine matrix are filled only if it is. The state is not changed.
    """
    height, width = image.shape
    work = make_resampling(state.memory[WORKSPACE_SIZE:], state.corner)
    corner_x, corner_y = anchor_of(x) - AREA_PX // 2, anchor_of(y) - AREA_PX // 2
    load_window(image, anchor_of(x), anchor_of(y), work.area)
    key = state.keys[k, 1]
    key_affine = key_affine_of(state, k, key)
    before = product2(affine_of(state, k), inverse2(key_affine))
    template = key_template_of(state, k, key)
    for form in (FREE, RIGID):
        A = before.copy()
        found = align(x - corner_x, y - corner_y, A, template, form, work)
        point_x, point_y = found.x + corner_x, found.y + corner_y
        shift = np.hypot(point_x - x, point_y - y)
        verdict, detail = judge(found, shift, stretch(product2(A, inverse2(before))))
        out[RESIDUAL], out[CORRELATION], out[DETAIL] = found.residual, found.correlation, detail
        if verdict == FOUND:
            break
    if not fits(point_x, point_y, width, height):
        verdict = LEFT
    out[VERDICT] = verdict
    if verdict == FOUND:
        out[0], out[1] = point_x, point_y
        out[COVARIANCE] = place_covariance(state, k, key, before, A, found).reshape(4)
        out[COLUMNS:] = product2(A, key_affine).reshape(4)


@njit(cache=True)
def take_over(image: ImageArray, k: int, state: TrackerState, place: FloatArray) -> None:
    """Make a result of `settle` the state of point k."""
    state.places[k, :2] = place[PLACE]
    affine_of(state, k)[:] = place[COLUMNS:].reshape(2, 2)
    renew_search(image, state, k)
    if place[CORRELATION] >= REFRESH_CORRELATION:
        choose_key(image, state, k, place[COVARIANCE].reshape(2, 2))


@njit(cache=True, inline="always")
def place_covariance(
    state: TrackerState, k: int, key: int, before: FloatArray, A: FloatArray, found: Alignment
) -> FloatArray:
    """Covariance of a found position: of the alignment, its prior, and the key template.

    A S Aᵀ + A F Aᵀ + A C_key Aᵀ, with S the template's spread for the noise in the residual, and F
    the effect of the prior on the form, the affine matrix expected before.
    """
    template = key_template_of(state, k, key)
    inner = key_covariance_of(state, k, key).copy()
    inner += honest_spread(template.spread, found.residual / found.gain)
    inner += spread_by_form(template, product2(inverse2(before), A))
    out = product2(product2(A, inner), A.T)
    out[0, 0] += FLOOR_PX**2
    out[1, 1] += FLOOR_PX**2
    return out


@njit(cache=True, inline="always")
def spread_by_form(template: AlignmentTemplate, changed: FloatArray) -> FloatArray:
    """Covariance of a position, (2, 2) px², from an undetected change of form of its patch.

    With the normal matrix N and the prior Λ, an alignment that assumes the previous form misses the
    position by N⁻¹ Λ a for a change a. If the patch shows the change, this is zero; a mark in one
    of its corners hides a rotation about the mark, which moves the point.

    Args:
        template: of the patch.
        changed: change of the affine matrix, as far as found, (2, 2).
    """
    apart = (changed[0, 0] - 1.0) ** 2 + (changed[1, 1] - 1.0) ** 2
    square = 0.5 * (apart + changed[0, 1] ** 2 + changed[1, 0] ** 2)
    missed, out = template.inverse[FREE, :2, 2:6], np.zeros((2, 2))
    for row in range(2):
        for column in range(2):
            for k in range(4):
                out[row, column] += missed[row, k] * missed[column, k]
    out *= square * FORM_PRIOR**2
    return out


@njit(cache=True, inline="always")
def honest_spread(spread: FloatArray, noise: float) -> FloatArray:
    """Covariance of a position, (2, 2) px², from a template's spread and the noise in it.

    Along a straight edge the template has no gradient but that of its own noise, which carries no
    information: the information of noise alone is subtracted, doubled for safety. An edge at an
        angle to
    the pixel grid has steps, which move with the grid: information far smaller than that across the
    edge is therefore ignored.

    Args:
        spread: for noise of one grey level, (2, 2) px².
        noise: standard deviation of the residual of template and image, grey levels.
    """
    information = inverse2(spread)
    half = 0.5 * (information[0, 0] - information[1, 1])
    middle = 0.5 * (information[0, 0] + information[1, 1])
    apart = np.hypot(half, information[0, 1])
    variance = max(noise * noise, 1e-6)
    by_noise = variance * NOISE_GRADIENT
    least = variance / (RANGE_PX * RANGE_PX / 3.0)
    across, along = middle + apart, max(middle - apart, 1e-12)
    strong = variance / max(across - by_noise, least)
    weak = variance / max(along - (EDGE * across) ** 2 / along - by_noise, least)
    strong += TURNED * TURNED * weak  # the long axis is known no better than the patch's rotation
    c, s = (half / apart, information[0, 1] / apart) if apart > 0.0 else (1.0, 0.0)
    out = np.empty((2, 2))
    mean, off = 0.5 * (strong + weak), 0.5 * (strong - weak)
    out[0, 0], out[1, 1] = mean + off * c, mean - off * c
    out[0, 1], out[1, 0] = off * s, off * s
    return out


@njit(cache=True)
def track_points(image: ImageArray, state: TrackerState, answers: FloatArray) -> bool:
    """Find all points, each expected at answers[k, PLACE]; return whether all were found."""
    expected, count = answers[:, :2].copy(), len(answers)
    places = np.empty((count, MOST_PLACES, COLUMNS + 4))
    alike = np.zeros(count, dtype=np.int64)
    for k in range(count):
        out = answers[k]
        out[RESIDUAL], out[CORRELATION], out[DETAIL] = np.nan, np.nan, np.nan
        out[VERDICT] = NO_TEMPLATE
        if state.keys[k, 0] > 0:
            alike[k] = that_look_alike(places[k], settle_all(image, k, state, out, places[k]))
    found = answers[:, VERDICT] == FOUND
    sure = found & (alike < 2)
    for k in range(count):
        if not found[k]:
            continue
        chosen = 0
        if alike[k] > 1:
            x, y = where_neighbours_go(k, expected, answers, sure)
            settle(image, x, y, k, state, places[k, alike[k]])  # the search may not have found it
            alike[k] = that_look_alike(places[k], alike[k] + 1)
            off = np.hypot(places[k, : alike[k], 0] - x, places[k, : alike[k], 1] - y)
            chosen = int(np.argmin(off))
        if alike[k] > 1 and np.sum(sure) < CONSENSUS:
            widen_for_others(places[k, : alike[k]], chosen)
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
def widen_for_others(places: FloatArray, chosen: int) -> None:
    """Widen the covariance of the chosen position so that the others lie within one deviation.

    It is isotropic, since the search follows only some of many marks in rows.
    """
    farthest = 0.0
    for n in range(len(places)):
        x, y = places[n, 0] - places[chosen, 0], places[n, 1] - places[chosen, 1]
        farthest = max(farthest, x * x + y * y)
    places[chosen, 2] += farthest
    places[chosen, 5] += farthest


@njit(cache=True, inline="always")
def that_look_alike(places: FloatArray, count: int) -> int:
    """Move the positions that match about as well as the best to the front; return how many.

    If the first one is the best by a margin, it is the only one.
    """
    alike = min(count, 1)
    for n in range(1, count):
        found = places[n, VERDICT] == FOUND
        if found and places[n, CORRELATION] > places[0, CORRELATION] - ALIKE:
            places[alike] = places[n].copy()
            alike += 1
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
