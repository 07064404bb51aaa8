"""Whether the outline of an object fits as well after a large turn about its weakest axis.

Seen from the side, the handle of a jug may point a little towards the camera or as much away from
it: two turns with the same outline, each of which seems certain if only its own surroundings are
examined. A handle that was hidden may appear anywhere. A turn is therefore known only after a
comparison with the others that were possible before the image.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from vergence.arrays import FloatArray, ImageArray, frozen
from vergence.geometry import angle_between, pose_difference, se3, se3_compose, se3_exp
from vergence.vision.known_object.contour_fit import (
    DEEP_ODDS,
    fit_contour,
    line_weights,
    outline_motion,
)
from vergence.vision.known_object.contour_lines import REACH, ContourLines, read_lines
from vergence.vision.known_object.object_model import ObjectModel
from vergence.vision.known_object.silhouette import Outline, outline_of

_LINES = 60  # across an outline
_ALIKE = 2.0  # neighbouring lines that count as one: their errors have one cause
_CELLS = 120  # along a side of the mask: half as fine as for a measurement
_SURE_RAD = 0.06  # deviation of a turn that a measurement may state by itself
_STEP_RAD = np.deg2rad(15.0)  # between turns that are tried, at most
_MOST_SCALE = 5  # pixels in a segment; odd
_STEPS = 3  # of Newton for each outline
_OUTLINES = 2  # of a fit in detail, one after the other, at one pixel a segment
_TOLERANCE_PX = 1.5  # residual at which a line counts a quarter, at one pixel a segment
_RUN_PX = 6.0  # mean residual of a run likewise: a handle elsewhere is no exception
_PRECISE_PX = 0.7  # standard deviation of the residuals of an outline that fits, likewise
_ABSENT = float(np.log(0.1 / 0.5))  # of a line without contour: one in ten, or half by chance
_CLEAR = 1.0 / 3.0**2  # information of a line that tells where the contour is, 1/px²
_DECIDED = float(np.log(1e3))  # log likelihood ratio: one error in a thousand [Wald1945]
_MOST_FINE = 4  # turns that are compared in detail
_SAME_RAD = 0.05  # between starts that have led to one pose
_SPAN = 3.0  # standard deviations within which a turn was possible
_ANYWHERE_RAD = 0.25  # standard deviation beyond which any turn was
_LOOSE_RAD = 0.1  # of the turn, during a fit


class TurnTest(NamedTuple):
    """What an image says about the turns that were possible before it."""

    moved: FloatArray  # (6,) motion (δp, δθ) to the turn that fits; 0 if none fits clearly better
    undecided: FloatArray  # (6, K) motion from it to the farthest turn that fits as well, K = 0 … 1


SURE = TurnTest(frozen(np.zeros(6)), frozen(np.zeros((6, 0))))  # no other turn was possible


class View(NamedTuple):
    """An image, and what may be found in it."""

    image: ImageArray  # (height, width, 1 or 3)
    lens: FloatArray  # (11,) packed camera
    odds: FloatArray  # (16, B) log odds of each colour to be the object's
    shape: ObjectModel  # the object
    closed: bool  # whether its mesh is
    spacing_px: float  # distance of places that err independently


class _Fit(NamedTuple):
    T: FloatArray  # (4, 4)
    nats: float  # log likelihood ratio to chance of what is found of the outline


def compare_turns(
    view: View, T: FloatArray, motion: FloatArray, covariance: FloatArray, half_px: float
) -> TurnTest:
    """Compare a pose with those turned along its weakest motion.

    Args:
        view: the image.
        T: the pose that fits, (4, 4).
        motion: the weakest (δp, δθ), with a unit rotation, (6,).
        covariance: (6, 6) of the pose that was predicted.
        half_px: half the object's size in the image.
    """
    deviation = float(np.sqrt(motion[3:] @ covariance[3:, 3:] @ motion[3:]))
    if deviation < _SURE_RAD:
        return SURE
    span = np.pi if deviation > _ANYWHERE_RAD else _SPAN * deviation
    count = int(np.ceil(span / _STEP_RAD))
    angles = span * np.repeat(np.arange(count, 0, -1), 2) / count  # the largest first
    angles[1::2] *= -1.0
    loose = covariance + _LOOSE_RAD**2 * np.outer(motion, motion)
    information = np.ascontiguousarray(np.linalg.inv(loose))
    scale = _scale_for(0.5 * span / count * half_px)

    def fitted(start: FloatArray, scale: int) -> tuple[_Fit, _Fit]:
        return _fit(view, start, information, scale)

    def refined(T: FloatArray) -> list[_Fit]:
        for finer in range(scale - 2, 1, -2):
            T = fitted(T, finer)[-1].T
        fits: list[_Fit] = []
        for _ in range(_OUTLINES):
            fits += fitted(fits[-1].T if fits else T, 1)
        return fits

    def turn_from(T_from: FloatArray, T_to: FloatArray) -> float:
        return abs(float(motion[3:] @ pose_difference(T_to, T_from)[3:]))

    def farthest(fit: _Fit, others: Sequence[_Fit]) -> FloatArray:
        far = max(others, key=lambda other: turn_from(fit.T, other.T))
        known = turn_from(fit.T, far.T) <= _SURE_RAD  # a measurement may state it by itself
        return np.zeros((6, 0)) if known else pose_difference(far.T, fit.T)[:, None]

    own = fitted(T, scale)[-1]
    tried = likely = [own]
    for angle in angles:
        tried = [*tried, fitted(turned(T, angle * motion), scale)[-1]]
        likely = _likely(tried)
        if len(likely) > _MOST_FINE:  # more would not decide it
            return TurnTest(np.zeros(6), farthest(own, likely))
    fine = refined(T)
    own = fine[-1]
    for fit in sorted(likely, key=lambda fit: -turn_from(T, fit.T)):
        fine += refined(fit.T)
        as_good = _likely(fine)
        if as_good[0].nats < own.nats + _DECIDED and farthest(own, as_good).size:
            return TurnTest(np.zeros(6), farthest(own, [*likely, *as_good]))
    best = as_good[0]
    if best.nats > own.nats + _DECIDED and turn_from(T, best.T) > _SURE_RAD:
        moved = pose_difference(best.T, T)
        return TurnTest(moved, farthest(best, as_good))
    return TurnTest(np.zeros(6), farthest(own, as_good))


def turned(T: FloatArray, motion: FloatArray) -> FloatArray:
    """Return a pose (4, 4) after a screw motion (δp, δθ), however large, about its origin."""
    about, back = se3(np.eye(3), T[:3, 3]), se3(np.eye(3), -T[:3, 3])
    return se3_compose(about, se3_compose(se3_exp(motion), se3_compose(back, T)))


def _likely(fits: Sequence[_Fit]) -> list[_Fit]:
    """Return the distinct fits that are not clearly worse than the best, the best first."""
    least = max(fit.nats for fit in fits) - _DECIDED
    likely: list[_Fit] = []
    for fit in sorted(fits, key=lambda fit: -fit.nats):
        apart = all(angle_between(fit.T, other.T) > _SAME_RAD for other in likely)
        if fit.nats > least and apart:
            likely.append(fit)
    return likely


def _scale_for(reach_px: float) -> int:
    """Return the pixels in a segment with which lines reach so far."""
    needed = reach_px / REACH
    return int(np.clip(2 * np.ceil(0.5 * (needed - 1.0)) + 1, 1, _MOST_SCALE))


def _fit(view: View, start: FloatArray, information: FloatArray, scale: int) -> tuple[_Fit, _Fit]:
    """Return how well a start (4, 4) fits, and what fits near it."""
    shape = view.shape
    outline = outline_of(
        start, view.lens, shape.vertices, shape.triangles, view.closed, _LINES, _CELLS
    )
    if outline is None:
        return _Fit(start, 0.0), _Fit(start, 0.0)
    lines = read_lines(view.image, outline, view.odds, scale)
    T = fit_contour(
        start, start, information, view.lens, outline, lines, line_weights(lines),
        _TOLERANCE_PX * scale, _RUN_PX * scale, _STEPS,
    )  # fmt: skip
    per = _ALIKE * view.spacing_px
    before, after = (
        found_nats(outline, lines, outline_motion(each, view.lens, outline)[0], scale)
        for each in (start, T)
    )
    return _Fit(start, before / per), _Fit(T, after / per)


def found_nats(outline: Outline, lines: ContourLines, moved: FloatArray, scale: int) -> float:
    """Return the log likelihood ratio to chance of an outline, times the distance of its places.

    log(N(r; 0, σ) / U) with a residual r, which chance spreads evenly over a line. A line with the
    object's colours inside and no contour at the outline counts against it; without such colours
    it counts nothing, since something is before the object. An outline that is longer has as many
    places that are farther apart, in px.

    Args:
        outline: places on it.
        lines: where they find the contour.
        moved: where the outline is on each of them, (N,), px.
        scale: pixels in a segment.
    """
    most = float(np.log((2 * REACH + 1) / (_PRECISE_PX * np.sqrt(2.0 * np.pi))))
    residual = (lines.offsets_px - moved) / (scale * _PRECISE_PX)
    clear = lines.information * scale**2 > _CLEAR
    nats = np.where(clear, np.fmax(most - 0.5 * residual**2, _ABSENT), _ABSENT)
    told = lines.usable & (lines.deep_odds > DEEP_ODDS)
    apart = outline.points_px - np.roll(outline.points_px, 1, axis=0)
    return float(nats[told].sum() * np.median(np.linalg.norm(apart, axis=1)))
