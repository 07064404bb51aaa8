"""The memory of the SSD tracker and the kernel that brings it from one image to the next.

Two templates serve two ends. The search, which must not miss, looks for the window of the last
image in which the point was found, as [Nelson1995] eq. (19) compares successive images. The
place, which must not drift, comes from an affine alignment to a key template that stays as long
as the measured change of form since it was taken is small; the sub-pixel offset of the point goes
with it.
"""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from vergence.arrays import FloatArray, ImageArray, IntArray
from vergence.vision.alignment import (
    AREA_PX,
    FREE,
    PATCH_PX,
    RESAMPLING_SIZE,
    RIGID,
    UNKNOWNS,
    Alignment,
    AlignmentTemplate,
    align,
    fill_template,
    make_resampling,
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
LOST_STRETCH = 1.6  # no patch changes form by more between two images
GAIN_RANGE = (0.25, 4.0)  # contrast against the key template
AT_BORDER_PX = 20.0  # a point lost when expected so near the border has probably left
FIT_PX = 8.0  # this far from the border at least: half of the 16 × 16 window
CONSENSUS = 3  # points found that say where the others may have gone
LOOK_AGAIN_PX = 6.0  # if they moved this far at least
FLOOR_PX = 0.01  # standard deviation that no alignment beats: interpolation, quantised grey levels

FOUND, LEFT, NO_MATCH, DISAGREES, DEFORMED, CONTRAST, NO_TEMPLATE, AT_BORDER = range(8)


class TrackerState(NamedTuple):
    """All that the tracker knows about M points with up to K key templates each.

    Few arrays, since each costs a call from Python 0.2 µs; the functions below say what is where.
    """

    places: FloatArray  # (M, 8) px where last found; affine 2 × 2 from first image to last; search
    # offset: point less centre of the search template, px
    search: Patch  # (M, 448) search template
    jacobian: Patch  # (M, K, 8, n) of the key templates
    inverse: FloatArray  # (M, K, 2, 8, 8) of the key templates
    facts: FloatArray  # (M, K, 16) of the key templates: 4 of the alignment; affine 2 × 2 from the
    # first image to the template's; covariance 2 × 2 of the point's place in it, px²; spread 2 × 2
    keys: IntArray  # (M, 2) how many key templates there are, and which one is in use
    memory: Patch  # what the kernels write to
    corner: NDArray[np.int32]  # likewise


# Columns of what the kernel answers for each point.
PLACE, COVARIANCE = slice(0, 2), slice(2, 6)  # px, px²
RESIDUAL, CORRELATION, DETAIL, VERDICT = 6, 7, 8, 9  # detail: the number behind the verdict
COLUMNS = 10


def empty_state(count: int) -> TrackerState:
    """Allocate the memory for a number of points."""
    n, f4 = PATCH_PX * PATCH_PX, np.float32
    places = np.zeros((count, 8))
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


@njit(cache=True)
def affine_of(state: TrackerState, k: int) -> FloatArray:
    """Affine matrix of point k from the first image to the last, (2, 2)."""
    return state.places[k, 2:6].reshape(2, 2)


@njit(cache=True)
def key_affine_of(state: TrackerState, k: int, key: int) -> FloatArray:
    """Affine matrix of point k from the first image to that of a key template, (2, 2)."""
    return state.facts[k, key, 4:8].reshape(2, 2)


@njit(cache=True)
def key_covariance_of(state: TrackerState, k: int, key: int) -> FloatArray:
    """Covariance of the place of point k in a key template, (2, 2) px²."""
    return state.facts[k, key, 8:12].reshape(2, 2)


@njit(cache=True)
def key_template_of(state: TrackerState, k: int, key: int) -> AlignmentTemplate:
    """Key template of point k."""
    facts = state.facts[k, key]
    return AlignmentTemplate(
        state.jacobian[k, key], state.inverse[k, key], facts[:4], facts[12:].reshape(2, 2)
    )


@njit(cache=True)
def fits(x: float, y: float, width: int, height: int) -> bool:
    """Whether the 16 × 16 window around a point lies in the image."""
    return FIT_PX - 0.5 <= x <= width - FIT_PX - 0.5 and FIT_PX - 0.5 <= y <= height - FIT_PX - 0.5


@njit(cache=True)
def inverse2(A: FloatArray) -> FloatArray:
    """Inverse of a 2 × 2 matrix."""
    determinant = A[0, 0] * A[1, 1] - A[0, 1] * A[1, 0]
    out = np.empty((2, 2))
    out[0, 0], out[0, 1] = A[1, 1] / determinant, -A[0, 1] / determinant
    out[1, 0], out[1, 1] = -A[1, 0] / determinant, A[0, 0] / determinant
    return out


@njit(cache=True)
def product2(A: FloatArray, B: FloatArray) -> FloatArray:
    """A B for 2 × 2 matrices."""
    out = np.empty((2, 2))
    for i in range(2):
        for j in range(2):
            out[i, j] = A[i, 0] * B[0, j] + A[i, 1] * B[1, j]
    return out


@njit(cache=True)
def stretch(A: FloatArray) -> float:
    """The larger of σ₁ and 1/σ₂ of a 2 × 2 matrix: 1 for a rotation."""
    total = 0.5 * (A[0, 0] ** 2 + A[0, 1] ** 2 + A[1, 0] ** 2 + A[1, 1] ** 2)
    determinant = abs(A[0, 0] * A[1, 1] - A[0, 1] * A[1, 0])
    root = np.sqrt(max(total * total - determinant * determinant, 0.0))
    largest = np.sqrt(total + root)
    return float(max(largest, largest / max(determinant, 1e-12)))


@njit(cache=True)
def add_key(image: ImageArray, state: TrackerState, k: int, covariance: FloatArray) -> None:
    """Take a new key template of point k where it is; a full memory loses its newest."""
    key = min(state.keys[k, 0], KEYS - 1)
    x, y = state.places[k, 0], state.places[k, 1]
    fill_template(image, anchor_of(x), anchor_of(y), x, y, key_template_of(state, k, key))
    key_affine_of(state, k, key)[:] = affine_of(state, k)
    key_covariance_of(state, k, key)[:] = covariance
    state.keys[k, 0], state.keys[k, 1] = key + 1, key


@njit(cache=True)
def renew_search(image: ImageArray, state: TrackerState, k: int) -> None:
    """Take the window at point k as what to search for next."""
    x, y = state.places[k, 0], state.places[k, 1]
    anchor_x, anchor_y = anchor_of(x), anchor_of(y)
    memory = state.memory[:256].reshape(16, 16)
    make_template(image, anchor_x, anchor_y, memory, template_in(state.search[k]))
    state.places[k, 6], state.places[k, 7] = x - (anchor_x - 0.5), y - (anchor_y - 0.5)


@njit(cache=True)
def start_points(image: ImageArray, state: TrackerState) -> None:
    """Take the first templates of all points whose window fits into the image."""
    height, width = image.shape
    for k in range(len(state.places)):
        if fits(state.places[k, 0], state.places[k, 1], width, height):
            add_key(image, state, k, np.zeros((2, 2)))
            renew_search(image, state, k)


@njit(cache=True)
def choose_key(image: ImageArray, state: TrackerState, k: int, covariance: FloatArray) -> None:
    """Keep the key template, go back to an older one whose form is near, or take a new one.

    Going back undoes whatever drift the newer ones have brought.
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


@njit(cache=True)
def judge(found: Alignment, shift: float, change: float) -> tuple[int, float]:
    """Say whether an alignment is the point: the verdict and its number."""
    if found.correlation < LOST_CORRELATION:
        return NO_MATCH, found.correlation
    if not GAIN_RANGE[0] <= found.gain <= GAIN_RANGE[1]:
        return CONTRAST, found.gain
    if shift > LOST_SHIFT_PX:
        return DISAGREES, shift
    if change > LOST_STRETCH:
        return DEFORMED, change
    return FOUND, found.correlation


@njit(cache=True)
def track_point(image: ImageArray, k: int, state: TrackerState, out: FloatArray) -> int:
    """Find point k, expected at out[PLACE], in an image; returns the verdict.

    Where the best window of the search turns out not to be the point, the place where it was
    expected is tried too.
    """
    height, width = image.shape
    x, y = out[0], out[1]
    if not (-RANGE_PX <= x < width + RANGE_PX and -RANGE_PX <= y < height + RANGE_PX):
        return LEFT
    offset_x, offset_y = state.places[k, 6], state.places[k, 7]
    anchor_x, anchor_y = anchor_of(x - offset_x), anchor_of(y - offset_y)
    work = make_workspace(state.memory[:WORKSPACE_SIZE])
    dx, dy = search(image, anchor_x, anchor_y, template_in(state.search[k]), work)
    start_x, start_y = anchor_x - 0.5 + offset_x, anchor_y - 0.5 + offset_y
    verdict = settle(image, start_x + dx, start_y + dy, k, state, out)
    if verdict == FOUND:
        return FOUND
    answer = out.copy()
    if settle(image, x, y, k, state, out) == FOUND:
        return FOUND
    out[:] = answer
    border = min(x + 0.5, y + 0.5, width - 0.5 - x, height - 0.5 - y)
    if border < AT_BORDER_PX:
        out[DETAIL] = max(border, 0.0)
        return AT_BORDER
    return verdict


@njit(cache=True)
def settle(
    image: ImageArray, x: float, y: float, k: int, state: TrackerState, out: FloatArray
) -> int:
    """Align point k from a start; if that is the point, take it over into out and the state."""
    height, width = image.shape
    work = make_resampling(state.memory[WORKSPACE_SIZE:], state.corner)
    corner_x, corner_y = anchor_of(x) - AREA_PX // 2, anchor_of(y) - AREA_PX // 2
    load_window(image, anchor_of(x), anchor_of(y), work.area)
    key = state.keys[k, 1]
    key_affine, affine = key_affine_of(state, k, key), affine_of(state, k)
    before = product2(affine, inverse2(key_affine))
    template, verdict = key_template_of(state, k, key), NO_MATCH
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
        return LEFT
    if verdict != FOUND:
        return verdict
    out[0], out[1] = point_x, point_y
    state.places[k, 0], state.places[k, 1] = point_x, point_y
    affine[:] = product2(A, key_affine)
    covariance = place_covariance(state, k, key, A, found)
    out[COVARIANCE] = covariance.reshape(4)
    renew_search(image, state, k)
    if found.correlation >= REFRESH_CORRELATION:
        choose_key(image, state, k, covariance)
    return FOUND


@njit(cache=True)
def place_covariance(
    state: TrackerState, k: int, key: int, A: FloatArray, found: Alignment
) -> FloatArray:
    """Covariance of a found place: of this alignment, and of the key template's own place.

    σ² A S Aᵀ / g² + A C_key Aᵀ, with σ from the residual and S the template's spread.
    """
    inner = key_covariance_of(state, k, key).copy()
    spread = key_template_of(state, k, key).spread
    inner += (found.residual / found.gain) ** 2 * spread
    out = product2(product2(A, inner), A.T)
    out[0, 0] += FLOOR_PX**2
    out[1, 1] += FLOOR_PX**2
    return out


@njit(cache=True)
def track_points(image: ImageArray, state: TrackerState, answers: FloatArray) -> bool:
    """Find all points, each expected at answers[k, PLACE]; whether all were found."""
    expected, lost = answers[:, :2].copy(), 0
    for k in range(len(answers)):
        out = answers[k]
        out[RESIDUAL], out[CORRELATION], out[DETAIL] = np.nan, np.nan, np.nan
        verdict = track_point(image, k, state, out) if state.keys[k, 0] > 0 else NO_TEMPLATE
        out[VERDICT] = verdict
        lost += verdict != FOUND
    if 0 < lost <= len(answers) - CONSENSUS:
        look_again(image, state, expected, answers)
    complete = True
    for out in answers:
        if out[VERDICT] != FOUND:
            complete = False
            out[2], out[5] = RANGE_PX * RANGE_PX / 3.0, RANGE_PX * RANGE_PX / 3.0
            out[3], out[4] = 0.0, 0.0
    return complete


@njit(cache=True)
def look_again(
    image: ImageArray, state: TrackerState, expected: FloatArray, answers: FloatArray
) -> None:
    """Search the points not found once more, where the others' median motion takes them."""
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
