"""Where a tracked point is near a start: its key template aligned, the result judged."""

import numpy as np
from numba import njit

from vergence.arrays import FloatArray, ImageArray
from vergence.vision.alignment import (
    AREA_PX,
    FORM_PRIOR,
    FREE,
    RIGID,
    ROOT_WEIGHTS,
    Alignment,
    AlignmentTemplate,
    agreement,
    align,
    make_resampling,
    product,
    resample,
)
from vergence.vision.pyramid import anchor_of, halve, load_quarter, load_window
from vergence.vision.ssd import (
    WORKSPACE_SIZE,
    template_in,
)
from vergence.vision.ssd_surface import RANGE_PX
from vergence.vision.tracker_state import (
    ALONE,
    COLUMNS,
    CONTRAST,
    CORRELATION,
    COVARIANCE,
    DEFORMED,
    DETAIL,
    DISAGREES,
    FOUND,
    LEFT,
    NO_MATCH,
    RESIDUAL,
    VERDICT,
    TrackerState,
    affine_of,
    key_affine_of,
    key_covariance_of,
    key_template_of,
)
from vergence.vision.two_by_two import inverse2, product2, stretch

LOST_CORRELATION = 0.75
DOUBTFUL = 0.85  # correlation below which a match may be chance, if its surroundings differ
SURROUNDINGS = 0.5  # smallest correlation of those of a doubtful match
LOST_SHIFT_PX = 4.0  # search and alignment must agree within this
LOST_STRETCH = 1.6  # no patch changes form by more between two images
GAIN_RANGE = (0.25, 4.0)  # contrast against the key template
FIT_PX = 8.0  # smallest distance from the border: half of the 16 × 16 window
_WEIGHTS = ROOT_WEIGHTS.astype(np.float64) ** 2
# Information from noise alone, px⁻², over its variance. A central difference has half the variance
# of a pixel; half of the residual's is the template's; doubled for safety.
NOISE_GRADIENT = float(0.5 * _WEIGHTS.sum() ** 2 / (_WEIGHTS**2).sum())
EDGE = 0.15  # of the information across: less along it may come from the pixel grid
TURNED = 0.06  # rad, standard deviation of a patch's direction along an edge
FLOOR_PX = 0.01  # lower bound on the standard deviation: interpolation, quantised grey levels


@njit(cache=True)
def settle(
    image: ImageArray,
    x: float,
    y: float,
    k: int,
    state: TrackerState,
    least: float,
    out: FloatArray,
) -> None:
    """Align point k from a start and judge whether it is the point; fills out, (COLUMNS + 4,).

    Position, covariance and affine matrix are filled only if it is. The state is not changed.

    Args:
        image: grey, (height, width).
        x: start, px.
        y: start, px.
        k: index of the point.
        state: of the tracker.
        least: correlation below which the place is of no use; -1 if it is always of use.
        out: columns as in the tracker's answers, and the affine matrix.
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
        found = align(x - corner_x, y - corner_y, A, template, form, least, work)
        point_x, point_y = found.x + corner_x, found.y + corner_y
        shift = np.hypot(point_x - x, point_y - y)
        verdict, detail = judge(found, shift, stretch(product2(A, inverse2(before))))
        out[RESIDUAL], out[CORRELATION], out[DETAIL] = found.residual, found.correlation, detail
        if verdict == FOUND or found.correlation < least:
            break
    doubtful = verdict == FOUND and out[CORRELATION] < DOUBTFUL
    if doubtful and surroundings_agree(image, point_x, point_y, k, state) < SURROUNDINGS:
        verdict = ALONE
    if not fits(point_x, point_y, width, height):
        verdict = LEFT
    out[VERDICT] = verdict
    if verdict == FOUND:
        out[0], out[1] = point_x, point_y
        out[COVARIANCE] = place_covariance(state, k, key, before, A, found).reshape(4)
        out[COLUMNS:] = product2(A, key_affine).reshape(4)


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
def surroundings_agree(image: ImageArray, x: float, y: float, k: int, state: TrackerState) -> float:
    """Correlation of the 64 × 64 px around a position with those of point k last, -1 … 1."""
    offset_x, offset_y = state.places[k, 6], state.places[k, 7]
    area, around = np.empty((16, 16), np.float32), np.empty((8, 8), np.float32)
    load_quarter(image, anchor_of(x - offset_x), anchor_of(y - offset_y), area)
    halve(area, around)
    wide = template_in(state.search[k]).wide
    now, before = (around - np.mean(around)).ravel(), (wide - np.mean(wide)).ravel()
    squares = max(product(now, now) * product(before, before), np.float32(1e-6))
    return float(product(now, before) / np.sqrt(squares))


@njit(cache=True, inline="always")
def fits(x: float, y: float, width: int, height: int) -> bool:
    """Whether the 16 × 16 window around a point lies in the image."""
    return FIT_PX - 0.5 <= x <= width - FIT_PX - 0.5 and FIT_PX - 0.5 <= y <= height - FIT_PX - 0.5


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
    angle to the pixel grid has steps, which move with the grid: information far smaller than that
    across the edge is therefore ignored.

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
