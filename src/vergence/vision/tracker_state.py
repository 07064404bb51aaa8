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

from vergence.arrays import FloatArray, ImageArray, IntArray
from vergence.vision.alignment import (
    AREA_PX,
    PATCH_PX,
    UNKNOWNS,
    Alignment,
    AlignmentTemplate,
    align,
    fill_template,
)
from vergence.vision.pyramid import Patch, anchor_of, load_window
from vergence.vision.ssd import RANGE_PX, SsdTemplate, SsdWorkspace, make_template, search

KEYS = 16  # key templates kept for each point
REFRESH_STRETCH = 1.2  # a new key template when any direction has stretched or shrunk by this
REFRESH_CORRELATION = 0.85  # and the old one is still recognised this well
LOST_CORRELATION = 0.7
LOST_SHIFT_PX = 3.5  # search and alignment must agree within this
LOST_STRETCH = 1.6  # no patch changes form by more between two images
GAIN_RANGE = (0.25, 4.0)  # contrast against the key template
FIT_PX = 8.0  # this far from the border at least: half of the 16 × 16 window
FLOOR_PX = 0.02  # standard deviation that no alignment beats: interpolation, quantised grey levels

FOUND, LEFT, NO_MATCH, DISAGREES, DEFORMED, CONTRAST, NO_TEMPLATE = range(7)


class TrackerState(NamedTuple):
    """All that the tracker knows about M points with up to K key templates each."""

    points: FloatArray  # (M, 2) px, where last found
    affine: FloatArray  # (M, 2, 2) from the first image to the last
    search_offset: FloatArray  # (M, 2) px, point less centre of the search template
    coarse: Patch  # (M, 8, 8)
    middle: Patch  # (M, 8, 8)
    full: Patch  # (M, 16, 16)
    key_values: Patch  # (M, K, n)
    key_jacobian: Patch  # (M, K, 8, n)
    key_inverse: FloatArray  # (M, K, 8, 8)
    key_offset: FloatArray  # (M, K, 2) px, point less centre of the key template
    key_moments: FloatArray  # (M, K, 2)
    key_affine: FloatArray  # (M, K, 2, 2) from the first image to the key template's
    key_covariance: FloatArray  # (M, K, 2, 2) px² of the point in the key template
    key_count: IntArray  # (M,) 0: there is no template
    key_active: IntArray  # (M,)


class TrackerOutput(NamedTuple):
    """What the kernel answers for M points."""

    points: FloatArray  # (M, 2) px
    covariance: FloatArray  # (M, 2, 2) px²
    residuals: FloatArray  # (M,) grey levels
    correlations: FloatArray  # (M,)
    detail: FloatArray  # (M,) the number that belongs to the verdict
    verdicts: IntArray  # (M,) FOUND, LEFT, …


def empty_state(count: int) -> TrackerState:
    """Allocate the memory for a number of points."""
    n, f4 = PATCH_PX * PATCH_PX, np.float32
    return TrackerState(
        np.zeros((count, 2)),
        np.tile(np.eye(2), (count, 1, 1)),
        np.zeros((count, 2)),
        np.zeros((count, 8, 8), f4),
        np.zeros((count, 8, 8), f4),
        np.zeros((count, 16, 16), f4),
        np.zeros((count, KEYS, n), f4),
        np.zeros((count, KEYS, UNKNOWNS, n), f4),
        np.zeros((count, KEYS, UNKNOWNS, UNKNOWNS)),
        np.zeros((count, KEYS, 2)),
        np.zeros((count, KEYS, 2)),
        np.zeros((count, KEYS, 2, 2)),
        np.zeros((count, KEYS, 2, 2)),
        np.zeros(count, np.int64),
        np.zeros(count, np.int64),
    )


def empty_output(count: int) -> TrackerOutput:
    """Allocate an answer for a number of points."""
    return TrackerOutput(
        np.zeros((count, 2)),
        np.zeros((count, 2, 2)),
        np.full(count, np.nan),
        np.full(count, np.nan),
        np.zeros(count),
        np.full(count, NO_TEMPLATE),
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
def key_template(state: TrackerState, k: int, key: int) -> AlignmentTemplate:
    """Key template of point k."""
    return AlignmentTemplate(
        state.key_values[k, key],
        state.key_jacobian[k, key],
        state.key_inverse[k, key],
        state.key_offset[k, key],
        state.key_moments[k, key],
    )


@njit(cache=True)
def search_template(state: TrackerState, k: int) -> SsdTemplate:
    """Search template of point k."""
    return SsdTemplate(state.coarse[k], state.middle[k], state.full[k])


@njit(cache=True)
def add_key(image: ImageArray, state: TrackerState, k: int, covariance: FloatArray) -> None:
    """Take a new key template of point k where it is; a full memory loses its newest."""
    key = min(state.key_count[k], KEYS - 1)
    x, y = state.points[k, 0], state.points[k, 1]
    fill_template(image, anchor_of(x), anchor_of(y), x, y, key_template(state, k, key))
    state.key_affine[k, key] = state.affine[k]
    state.key_covariance[k, key] = covariance
    state.key_active[k] = key
    state.key_count[k] = key + 1


@njit(cache=True)
def renew_search(image: ImageArray, state: TrackerState, k: int) -> None:
    """Take the window at point k as what to search for next."""
    x, y = state.points[k, 0], state.points[k, 1]
    anchor_x, anchor_y = anchor_of(x), anchor_of(y)
    make_template(image, anchor_x, anchor_y, search_template(state, k))
    state.search_offset[k, 0] = x - (anchor_x - 0.5)
    state.search_offset[k, 1] = y - (anchor_y - 0.5)


@njit(cache=True)
def start_points(image: ImageArray, state: TrackerState) -> None:
    """Take the first templates of all points whose window fits into the image."""
    height, width = image.shape
    for k in range(len(state.points)):
        if fits(state.points[k, 0], state.points[k, 1], width, height):
            add_key(image, state, k, np.zeros((2, 2)))
            renew_search(image, state, k)


@njit(cache=True)
def choose_key(image: ImageArray, state: TrackerState, k: int, covariance: FloatArray) -> None:
    """Keep the key template, go back to an older one whose form is near, or take a new one.

    Going back undoes whatever drift the newer ones have brought.
    """
    best, nearest = state.key_active[k], np.inf
    for key in range(state.key_count[k]):
        change = stretch(product2(state.affine[k], inverse2(state.key_affine[k, key])))
        if key == state.key_active[k] and change <= REFRESH_STRETCH:
            return
        if change < nearest:
            best, nearest = key, change
    if nearest <= REFRESH_STRETCH:
        state.key_active[k] = best
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
def track_point(
    image: ImageArray,
    k: int,
    state: TrackerState,
    work: SsdWorkspace,
    area: Patch,
    sample: Patch,
    out: TrackerOutput,
) -> int:
    """Find point k, expected at out.points, in an image; returns the verdict."""
    height, width = image.shape
    expected_x, expected_y = out.points[k, 0], out.points[k, 1]
    if not (
        -RANGE_PX <= expected_x < width + RANGE_PX and -RANGE_PX <= expected_y < height + RANGE_PX
    ):
        return LEFT
    offset, key = state.search_offset[k], state.key_active[k]
    anchor_x, anchor_y = anchor_of(expected_x - offset[0]), anchor_of(expected_y - offset[1])
    dx, dy, _ = search(image, anchor_x, anchor_y, search_template(state, k), work)
    x, y = anchor_x - 0.5 + offset[0] + dx, anchor_y - 0.5 + offset[1] + dy
    corner_x, corner_y = anchor_of(x) - AREA_PX // 2, anchor_of(y) - AREA_PX // 2
    load_window(image, anchor_of(x), anchor_of(y), area)
    A = product2(state.affine[k], inverse2(state.key_affine[k, key]))
    before = A.copy()
    found = align(area, x - corner_x, y - corner_y, A, key_template(state, k, key), sample)
    out.residuals[k], out.correlations[k] = found.residual, found.correlation
    point_x, point_y = found.x + corner_x, found.y + corner_y
    shift = np.hypot(point_x - x, point_y - y)
    verdict, detail = judge(found, shift, stretch(product2(A, inverse2(before))))
    out.detail[k] = detail
    if not fits(point_x, point_y, width, height):
        return LEFT
    if verdict != FOUND:
        return verdict
    out.points[k, 0], out.points[k, 1] = point_x, point_y
    state.points[k] = out.points[k]
    state.affine[k] = product2(A, state.key_affine[k, key])
    covariance = place_covariance(state, k, key, A, found)
    out.covariance[k] = covariance
    renew_search(image, state, k)
    if found.correlation >= REFRESH_CORRELATION:
        choose_key(image, state, k, covariance)
    return FOUND


@njit(cache=True)
def place_covariance(
    state: TrackerState, k: int, key: int, A: FloatArray, found: Alignment
) -> FloatArray:
    """Covariance of a found place: of this alignment, and of the key template's own place.

    σ² A (JᵀJ)⁻¹ Aᵀ / g² + A C_key Aᵀ, with σ from the residual.
    """
    inner = state.key_covariance[k, key].copy()
    scale = (found.residual / found.gain) ** 2
    for i in range(2):
        for j in range(2):
            inner[i, j] += scale * state.key_inverse[k, key, i, j]
    out = product2(product2(A, inner), A.T)
    out[0, 0] += FLOOR_PX**2
    out[1, 1] += FLOOR_PX**2
    return out


@njit(cache=True)
def track_points(
    image: ImageArray,
    state: TrackerState,
    work: SsdWorkspace,
    area: Patch,
    sample: Patch,
    out: TrackerOutput,
) -> None:
    """Find all points, each expected at out.points."""
    for k in range(len(state.points)):
        if state.key_count[k] == 0:
            out.verdicts[k] = NO_TEMPLATE
        else:
            out.verdicts[k] = track_point(image, k, state, work, area, sample, out)
        if out.verdicts[k] != FOUND:
            out.covariance[k] = np.eye(2) * (RANGE_PX * RANGE_PX / 3.0)
