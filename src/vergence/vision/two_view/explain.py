"""Explains the matches of two views by one motion, several, or none."""

from dataclasses import dataclass, replace

import numpy as np

from vergence.arrays import BoolArray, FloatArray
from vergence.geometry.chi_square import chi_square_quantile
from vergence.vision.two_view.bundle import GENERAL, PLANE, ROTATION
from vergence.vision.two_view.consensus import (
    agreements,
    errors_of,
    log_alarms_of,
    log_chance_of_flatness,
    off_plane,
)
from vergence.vision.two_view.evidence import CHANCE
from vergence.vision.two_view.failure import TwoViewFailure, TwoViewProblem
from vergence.vision.two_view.fit import (
    FEWEST_GENERAL,
    Comparison,
    Fit,
    Views,
    compare_models,
    hinging_on_one,
)
from vergence.vision.two_view.search import sampled_motions

_GATE = 3.7  # standard deviations within which a match agrees (99.9 % of two coordinates)
FLAT_CHANCE = -4.0  # log₁₀ of the NFA above which a plane is attributed to chance
_TOO_LARGE = 2.33  # standard deviations: 99 %, of the errors of few matches
_FEWEST = 5  # matches that determine every model
FEW = 16  # matches below which a single one may distort the motion
_ROUNDS = 2  # of fitting and finding the matches that agree


@dataclass(frozen=True, slots=True)
class Explanation:
    """The motions that explain the matches."""

    fits: list[Fit]  # the best first
    scale: float  # variance of the noise over the stated one, at least 1
    views: Views  # all usable matches, agreeing or not
    matrices: FloatArray  # (K, 3, 3) essential matrices of samples of five of these matches
    turned: int = 0  # number of other matches, explained by a pure rotation of the camera


def explain(views: Views, usable: BoolArray, flat: bool) -> Explanation | TwoViewFailure:
    """Find the motions that explain the matches.

    If a pure rotation of the camera explains most of them, they may belong to the background; then
    the others are tried separately, for an object that moves in front of it.

    Args:
        views: all matches.
        usable: mask of those that may be used, (N,).
        flat: whether the object is known to be flat.
    """
    found = _explain_once(views, usable, flat)
    if isinstance(found, TwoViewFailure):
        return found
    turn = next((fit for fit in found.fits if fit.model == ROTATION), None)
    if turn is None:
        return found
    rest = usable.copy()
    rest[turn.views.index] = False
    if np.count_nonzero(rest) >= FEWEST_GENERAL:
        second = _explain_once(views, rest, flat)
        if isinstance(second, Explanation) and all(f.model != ROTATION for f in second.fits):
            return replace(second, turned=len(turn.views))
    return TwoViewFailure(
        TwoViewProblem.NO_TRANSLATION,
        "a turn of the camera alone explains both views, so the object's shape is unknown; if that "
        "is the background, give a mask of the object to match_features",
        turn.state.R.T.copy(),
    )


def _explain_once(views: Views, usable: BoolArray, flat: bool) -> Explanation | TwoViewFailure:
    """Return the first acceptable explanation, or why the most likely one is not acceptable."""
    tried = views.take(usable)
    solid = len(tried) >= FEWEST_GENERAL
    matrices = sampled_motions(tried.m_star, tried.m) if solid else np.empty((0, 3, 3))
    if len(tried) == 4 and flat:
        sets = [np.ones(4, dtype=np.bool_)]
    else:
        found = agreements(tried, matrices) if len(tried) > 4 else []
        sets = [agreement.kept for agreement in found]
    failure: TwoViewFailure | None = None
    perhaps_flat: list[Fit] = []
    for k, kept in enumerate(sets):
        comparison = _settled(tried, kept)
        doubt = _doubted(comparison, tried, flat)
        if doubt is None:
            best, scale = comparison.fits[0], comparison.scale
            few = _FEWEST < len(best.views) < FEW and best.model != ROTATION
            others = hinging_on_one(best.views, best, scale) if few else []
            if few and best.model == PLANE:
                others += _solid_rivals(best, tried, sets[k + 1 :], flat)
            fits = [*perhaps_flat, *comparison.fits, *others]
            return Explanation(fits, scale, tried, matrices)
        failure = doubt if failure is None else failure
        if comparison.fits[0].model == PLANE and doubt.problem is TwoViewProblem.TOO_FEW:
            perhaps_flat.append(comparison.fits[0])
    return _by_chance(tried, 0) if failure is None else failure


def _solid_rivals(plane: Fit, views: Views, sets: list[BoolArray], flat: bool) -> list[Fit]:
    """Return the motions of a solid object that explain more of few matches than a plane does."""
    for kept in sets if not flat else []:
        comparison = _settled(views, kept)
        solid = comparison.fits[0]
        more = solid.model == GENERAL and len(solid.views) > len(plane.views)
        if more and _doubted(comparison, views, flat) is None:
            return [fit for fit in comparison.fits if fit.model == GENERAL]
    return []


def _settled(views: Views, kept: BoolArray) -> Comparison:
    """Return the models of the matches that agree with the best of them."""
    comparison = compare_models(views.take(kept))
    for _ in range(_ROUNDS):
        again = _agreeing(comparison.fits[0], comparison.scale, views)
        if comparison.fits[0].model == GENERAL:
            again = _without_chance(comparison, views, again)
        if np.count_nonzero(again) < 4 or np.array_equal(again, kept):
            break
        kept = again
        comparison = compare_models(views.take(kept))
    return _without_isolated(comparison, views)


def _without_isolated(comparison: Comparison, views: Views) -> Comparison:
    """Drop the matches that only chance brought to a motion, if there are wrong ones.

    The motion says nothing about where along its epipolar line a match is. A wrong match that is
    on the line is anywhere on it, so that its depth is unlike that of the others, and it may turn
    the motion by several deviations.
    """
    best = comparison.fits[0]
    if best.model != GENERAL or not FEW <= len(best.views) < len(views):
        return comparison
    kept = np.isin(views.index, best.views.index[~best.isolated])
    if np.count_nonzero(kept) in (len(best.views), 0):
        return comparison
    return compare_models(views.take(kept))


def _without_chance(comparison: Comparison, views: Views, kept: BoolArray) -> BoolArray:
    """Drop the matches off a plane if the plane is significant but they may be due to chance."""
    general, plane = comparison.fits[0], comparison.plane
    near = kept & _agreeing(plane, comparison.scale, views)
    if np.count_nonzero(near) < 5 or log_chance_of_flatness(plane, views, near) > FLAT_CHANCE:
        return kept
    error = max(float(errors_of(general, views)[kept].max()), views.noise)
    return kept if off_plane(views, near, kept, error) else near


def _agreeing(fit: Fit, scale: float, views: Views) -> BoolArray:
    # The distance between two measured points, or a point and a line through another, has twice
    # the variance of a coordinate.
    gate = np.sqrt(2.0 * scale) * _GATE * views.noise
    near: BoolArray = errors_of(fit, views) <= gate
    return near


def _doubted(comparison: Comparison, views: Views, flat: bool) -> TwoViewFailure | None:
    """Return why an explanation is rejected, None if it is not."""
    fit = comparison.fits[0]
    if flat and len(fit.views) == len(views):
        return None
    if log_alarms_of(fit, views) > CHANCE:
        return _by_chance(views, len(fit.views))
    on_plane = np.isin(views.index, fit.views.index)
    chance = log_chance_of_flatness(fit, views, on_plane) if fit.model == PLANE else -np.inf
    if chance > FLAT_CHANCE and not flat:
        return TwoViewFailure(
            TwoViewProblem.TOO_FEW,
            f"a plane explains {len(fit.views)} of {len(views)} matches, but so few may lie on one "
            "by chance; say that the object is flat if it is, or give eight matches or more",
        )
    if fit.model == GENERAL and len(fit.views) < FEWEST_GENERAL:
        return _by_chance(views, len(fit.views))
    few = fit.model == GENERAL and len(views) < FEW  # with more, the noise is estimated
    if few and fit.chi_square > chi_square_quantile(fit.freedom, _TOO_LARGE):
        return TwoViewFailure(
            TwoViewProblem.WRONG_MATCHES,
            f"the best motion leaves {np.sqrt(fit.chi_square / fit.freedom):.1f} times the stated "
            f"noise in {len(fit.views)} matches: one is wrong, or the noise is larger than stated",
        )
    return None


def _by_chance(views: Views, count: int) -> TwoViewFailure:
    if len(views) < FEWEST_GENERAL:
        return TwoViewFailure(
            TwoViewProblem.TOO_FEW,
            f"no plane explains {len(views)} matches better than chance; an object that is not "
            "flat takes eight",
        )
    return TwoViewFailure(
        TwoViewProblem.WRONG_MATCHES,
        f"the best motion explains {count} of {len(views)} matches, no more than chance would",
    )
