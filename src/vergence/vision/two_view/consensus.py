"""Finds the matches that agree on one rigid motion, beyond what chance explains."""

import numpy as np
from numba import njit

from vergence.arrays import BoolArray, FloatArray
from vergence.vision.two_view.bundle import GENERAL
from vergence.vision.two_view.evidence import (
    least_false_alarms,
    log_chance_of_plane,
    log_densities,
)
from vergence.vision.two_view.fit import FEWEST_GENERAL, Fit, Views
from vergence.vision.two_view.linear import homogeneous
from vergence.vision.two_view.motions import essential
from vergence.vision.two_view.search import (
    Agreement,
    ceiling,
    epipolar_errors,
    find_motion,
    find_plane,
    transfer_errors,
)

RELIEF = 0.2  # relative to its distance: assumed relief of an object that may not be flat
_TRIED = -0.5  # log₁₀ NFA below which a set of matches is fitted before it is judged
_CLEARLY = 2.0  # multiples of a plane's threshold within which a match may still be on it
_FARTHEST_ASIDE = 0.5  # of its distance: largest camera motion at which an object is recognised
_OFF_PLANE = -2.0  # log₁₀ NFA of the matches off a plane that prove an object not flat


def agreements(views: Views, matrices: FloatArray) -> list[Agreement]:
    """Return the sets of matches that agree on a plane's motion and on any motion, best first.

    Two matches off a plane determine the epipole, so some motion always fits them: only agreement
    beyond those two is evidence that the object is not flat [Chum2005].

    Args:
        views: the matches.
        matrices: essential matrices of samples of them, (K, 3, 3).
    """
    plane = find_plane(views.m_star, views.m, views.noise)
    found = [plane] if plane.log_alarms <= _TRIED else []
    if len(views) < FEWEST_GENERAL:
        return found
    general = find_motion(views.m_star, views.m, views.noise, matrices)
    if general.size < FEWEST_GENERAL or general.log_alarms > _TRIED:
        return found
    near = plane.errors <= _CLEARLY * plane.error
    if not found or not off_plane(views, near, general.kept, general.error):
        return [*found, general]
    return [general, plane]


def off_plane(views: Views, near: BoolArray, kept: BoolArray, error: float) -> bool:
    """Return whether more matches agree with a motion off a plane than chance explains.

    Args:
        views: all matches.
        near: mask of those on the plane, (N,).
        kept: mask of those that agree with the motion, (N,).
        error: their largest distance from the epipolar line.
    """
    off = kept & ~near
    if np.count_nonzero(off) < 3:
        return False
    _, band = log_densities(views.m_star, views.m)
    errors = np.where(off[~near], error, np.inf)
    alarms, _ = least_false_alarms(errors, 2, 1, 1, band, 0.0, np.inf)
    return bool(alarms < _OFF_PLANE)


def errors_of(fit: Fit, views: Views) -> FloatArray:
    """Return the distance of each match from a model, (N,), normalized coordinates."""
    state = fit.state
    if fit.model == GENERAL:
        return np.asarray(epipolar_errors(essential(state.R, state.t), views.m_star, views.m))
    H = np.ascontiguousarray(state.R + np.outer(state.t, state.n))
    return np.asarray(transfer_errors(H, views.m_star, views.m))


def log_alarms_of(fit: Fit, views: Views) -> float:
    """Return log₁₀ of the number of false alarms of a fit, within the region of its matches.

    If all matches agree, none were selected to determine the model.
    """
    disc, band = log_densities(fit.views.m_star, fit.views.m)
    general = fit.model == GENERAL
    sample, outcomes, power, density = (5, 10, 1, band) if general else (4, 1, 2, disc)
    errors, largest = errors_of(fit, views), ceiling(len(views)) * views.noise
    count = len(views)
    if len(fit.views) == count and count > sample and errors.max() <= largest:
        chance = min(0.0, power * np.log(max(errors.max(), views.noise)) + density)
        models = np.log(outcomes * (count - sample))
        return float((models + (count - sample) * chance) / np.log(10.0))
    alarms, _ = least_false_alarms(errors, sample, outcomes, power, density, views.noise, largest)
    return float(alarms)


def log_chance_of_flatness(plane: Fit, views: Views, near: BoolArray) -> float:
    """Return log₁₀ of the NFA of a plane, if the object has a relief.

    Args:
        plane: the plane.
        views: all matches.
        near: mask of those on the plane, (N,).
    """
    error = max(float(errors_of(plane, views)[near].max()), views.noise)
    # Inverse depths are in units of the plane's distance, as the translation is.
    inverse_depths = homogeneous(views.m_star[near]) @ plane.state.n
    # A plane found by chance often has a motion that is far too long.
    aside = float(np.linalg.norm(plane.state.t) * np.median(np.abs(inverse_depths)))
    parallax = RELIEF * min(aside, _FARTHEST_ASIDE)
    return float(log_chance_of_plane(len(views), int(np.count_nonzero(near)), error, parallax))


@njit(cache=True)
def distinct_matches(points: FloatArray, points_star: FloatArray, apart: float) -> BoolArray:
    """Return which matches (N,) are farther than `apart` from all before, in both views."""
    chosen = np.zeros(len(points), dtype=np.bool_)
    for j in range(len(points)):
        alone = True
        for i in range(j):
            if chosen[i]:
                here = np.hypot(points[j, 0] - points[i, 0], points[j, 1] - points[i, 1])
                there = np.hypot(
                    points_star[j, 0] - points_star[i, 0], points_star[j, 1] - points_star[i, 1]
                )
                if min(here, there) <= apart:
                    alone = False
                    break
        chosen[j] = alone
    return chosen
