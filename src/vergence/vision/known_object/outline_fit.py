"""The pose at which the outline of an object fits an image, and how well."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from vergence.arrays import BoolArray, FloatArray, ImageArray
from vergence.geometry import pose_difference
from vergence.robot.positive_definite import invert_spd
from vergence.vision.known_object.color_model import ColorModel, blank_colors, colors_of
from vergence.vision.known_object.contour_fit import (
    DEEP_ODDS,
    FORGIVING,
    Round,
    contour_points,
    fit_contour,
    line_weights,
    means_of_runs,
    misfit_of,
    outline_motion,
    rounds_for,
    shared_error,
)
from vergence.vision.known_object.contour_lines import ContourLines, count_colors, read_lines
from vergence.vision.known_object.outlined_shape import OutlinedShape
from vergence.vision.known_object.silhouette import Outline
from vergence.vision.known_object.silhouette_measurement import SilhouetteMeasurement, nothing_found
from vergence.vision.known_object.turn_test import turned
from vergence.vision.known_object.weak_turns import weakest_turns

INDEPENDENT = 60  # lines that err apart: neighbours share pixels
MISFIT_PX = 0.4  # up to which an outline fits well
_STEPS = 3  # of Newton for one outline
_LEARNING_GAPS_PX = (5.0, 2.0, 0.5)  # in the first image the contour is not known well
_GAP_PX = 0.5  # on both sides of the contour, where pixels show both
_LEARNED_DEPTH_PX = 18.0
_FOUND_PX = 2.0  # residual of a line that found the contour
_LEARNED_ODDS = 1.0  # and on one whose colours are learned
_CLEAR = 1.0 / 3.0**2  # information of a line that tells where the contour is, 1/px²
_CLEARLY = 0.95  # relative misfit of a pose that fits clearly better
_ELSEWHERE_RAD = 0.12  # turns from which a fit is begun anew


class Prior(NamedTuple):
    """What is known of a pose before the image."""

    T: FloatArray  # (4, 4) predicted pose
    covariance: FloatArray  # (6, 6) of its error (δp, δθ) along camera axes
    information: FloatArray  # (6, 6) its inverse


def prior_of(T: FloatArray, covariance: FloatArray) -> Prior:
    """Return a predicted pose (4, 4) with the covariance (6, 6) of its error."""
    covariance = np.array(covariance)
    return Prior(np.array(T), covariance, invert_spd(covariance)[0])


@dataclass(frozen=True, slots=True)
class OutlineFit:
    """Fits the outline of an object to one image."""

    shape: OutlinedShape
    lines: int  # across the outline
    bias_px: float  # of the outline, that does not average out along it
    pixels: ImageArray  # (height, width, 1 or 3)
    lens: FloatArray  # (11,) packed camera

    def learning(self, prior: Prior, colors: ColorModel) -> SilhouetteMeasurement:
        """Return what fits where a pose is predicted, with the colours that are learned there."""
        T = prior.T
        for gap_px in _LEARNING_GAPS_PX:
            outline = self._outline(T)
            if outline is not None:
                everywhere = np.ones(len(outline.points), dtype=np.bool_)
                gaps_px = np.full((len(everywhere), 2), gap_px)
                colors = self._counted(outline, everywhere, ~everywhere, gaps_px)
            seen = self.near(T, prior, colors)
            T = seen.T_camera_target
        return seen

    def near(
        self, T: FloatArray, prior: Prior, colors: ColorModel, rounds: Sequence[Round] = ()
    ) -> SilhouetteMeasurement:
        """Return what fits near a pose (4, 4); the outline of the last round is the measurement.

        Without given rounds, they are as coarse as the prediction needs.
        """
        outline = self._outline(T)
        left = list(rounds)
        while outline is not None:
            left = left or rounds_for(T, self.lens, outline, prior.covariance)
            scale, tolerance_px, run_px = left.pop(0)
            lines = read_lines(self.pixels, outline, colors.odds, scale)
            T = fit_contour(
                T,
                prior.T,
                prior.information,
                self.lens,
                outline,
                lines,
                line_weights(lines),
                tolerance_px,
                run_px,
                _STEPS,
            )
            if not left:
                return self._measured(T, outline, lines)
            outline = self._outline(T)
        return nothing_found(T, blank_colors(self.pixels.shape[2]))

    def elsewhere(
        self, prior: Prior, colors: ColorModel, seen: SilhouetteMeasurement
    ) -> SilhouetteMeasurement:
        """Return a measurement, or what fits clearly better of fits that begin anew near it.

        A fit may be right in most lines, and count as exceptions those that show it to be wrong:
        the ends of a bottle that is tilted otherwise. Where a rim is seen edge-on, the outline
        changes with the turn in another way on each side.
        """
        covariance = prior.covariance + _ELSEWHERE_RAD**2 * seen.weakest @ seen.weakest.T
        loose = prior_of(prior.T, covariance)
        T, fits = seen.T_camera_target, []
        turns = _ELSEWHERE_RAD * np.hstack((seen.weakest, -seen.weakest)).T
        for start in (T, *(turned(T, turn) for turn in turns)):
            fit = self.near(start, loose, colors, FORGIVING)
            if fit.share >= seen.share:
                fits.append(fit)
            if fits and fits[-1].misfit_px < MISFIT_PX:
                break
        best = min(fits, key=lambda fit: fit.misfit_px, default=seen)
        if best.misfit_px < _CLEARLY * seen.misfit_px:
            seen = best
        elif _CLEARLY * best.misfit_px < seen.misfit_px:  # it fits as well
            apart = pose_difference(best.T_camera_target, T)
            seen = seen._replace(shared=seen.shared + np.outer(apart, apart))
        return seen._replace(searched=True)

    def _outline(self, T: FloatArray) -> Outline | None:
        return self.shape.outline(T, self.lens, self.lines)

    def _measured(
        self, T: FloatArray, outline: Outline, lines: ContourLines
    ) -> SilhouetteMeasurement:
        moved, slopes = outline_motion(T, self.lens, outline)
        residuals, weights = lines.offsets_px - moved, line_weights(lines)
        runs = means_of_runs(residuals, outline, lines, weights)
        found = (
            lines.usable
            & (np.abs(residuals) < _FOUND_PX)
            & (lines.information > _CLEAR)
            & (lines.deep_odds > DEEP_ODDS)
        )
        slopes = slopes[found]
        learned = found & (lines.deep_odds > _LEARNED_ODDS)
        covered = lines.usable & (lines.deep_odds < -_LEARNED_ODDS)
        # What lies between the contour that was found and the outline that fits may be either's.
        inner, outer = np.sort((lines.offsets_px, moved), axis=0)
        gaps_px = _GAP_PX + np.fmax(np.stack((-inner, outer), axis=1), 0.0)
        unseen, shared = self.shape.unseen(T, self.lens, slopes), shared_error(slopes, self.bias_px)
        expected, count = int(lines.usable.sum()), int(found.sum())
        # The less of the outline is found, the likelier some of it is something else's.
        doubt = (expected / max(count, 1)) ** 3
        misfit_px = misfit_of(residuals, lines, weights)
        shared = doubt * max(misfit_px / MISFIT_PX, 1.0) ** 2 * shared
        enlarged = doubt * max(count / INDEPENDENT, 1.0)
        return SilhouetteMeasurement(
            *contour_points(outline, lines, found, enlarged, runs),
            T,
            expected,
            count,
            count / max(expected, 1),
            int(np.sum(lines.usable & ~found & (lines.deep_odds > DEEP_ODDS))),
            outline.points_px,
            found,
            self._counted(outline, learned, covered, gaps_px),
            unseen,
            shared,
            self.shape.astray(T, unseen),
            weakest_turns(slopes, self.shape.axes.motions(T)),
            misfit_px,
        )

    def _counted(
        self,
        outline: Outline,
        learned: BoolArray,
        covered: BoolArray,
        gaps_px: FloatArray,
    ) -> ColorModel:
        inside, outside = np.zeros((2, *blank_colors(self.pixels.shape[2]).inside.shape))
        count_colors(
            self.pixels, outline, learned, covered, gaps_px, _LEARNED_DEPTH_PX, inside, outside
        )
        colors: ColorModel = colors_of(inside, outside)
        return colors
