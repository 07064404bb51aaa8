"""The pose under which the outline of an object lies where lines across it find the contour."""

from typing import NamedTuple

import numpy as np
from numba import njit

from vergence.arrays import BoolArray, FloatArray
from vergence.geometry import moved_pose, pose_difference
from vergence.robot.positive_definite import factor_spd, solve_factored
from vergence.vision.known_object.contour_lines import REACH, ContourLines
from vergence.vision.known_object.projection import pixel_rows
from vergence.vision.known_object.silhouette import Outline

_INWARD = 0.6  # tolerance inward, as a share of that outward
_BESIDE, _BESIDE_PX = 6, 40.0  # lines to either side that make a run, and how far they may be
_CLIPPED_PX = 4.0  # residual that no line of a run exceeds
SLIDING_PX = 100.0  # standard deviation along the contour
DEEP_ODDS = 0.5  # mean log odds of the object's pixels on a line that counts
_MOST_SCALE = 5  # pixels in a segment; odd
_MOST_MISFIT_PX = 1.5  # residual that counts no more
_LEAST_SLOPE = 1e-9  # relative, of a motion that moves the outline at all


class Round(NamedTuple):
    """How one outline is compared with an image; several in turn fit a pose."""

    scale: int = 1  # pixels in a segment of a line
    tolerance_px: float = 1.5  # residual outward at which a line counts a quarter
    run_px: float = 0.6  # mean residual of a run of lines at which it counts a quarter, at least


# For a pose that is known to some pixels. What strict rounds count as exceptions may be what shows
# that the pose is wrong: forgiving ones begin with nearly none.
FINE = (Round(), Round())
FORGIVING = (Round(1, 6.0, np.inf), Round(1, 6.0, np.inf), Round(1, 3.0, 1.5), Round())


@njit(cache=True)
def fit_contour(
    T_start: FloatArray,
    T_prior: FloatArray,
    prior: FloatArray,
    lens: FloatArray,
    outline: Outline,
    lines: ContourLines,
    weights: FloatArray,
    tolerance_px: float,
    run_px: float,
    iterations: int,
) -> FloatArray:
    """Return the pose (4, 4) that fits the lines, by Newton steps on their robust squares.

    A line counts less the larger its residual, and a run of neighbours the larger their mean, as
    compared with that of other runs.

    Args:
        T_start: the pose of the outline, (4, 4).
        T_prior: the predicted pose, (4, 4).
        prior: information of the prediction's error (δp, δθ) along camera axes, (6, 6).
        lens: packed camera, (11,).
        outline: where the lines are.
        lines: where they find the contour.
        weights: of the lines, (N,) 0 … 1.
        tolerance_px: residual outward at which a line counts a quarter.
        run_px: mean residual of a run at which it counts a quarter, at least.
        iterations: how many steps.
    """
    T = T_start.copy()
    for _ in range(iterations):
        A, b = prior.copy(), prior @ pose_difference(T_prior, T)
        moved, slopes = outline_motion(T, lens, outline)
        residuals = lines.offsets_px - moved
        runs = means_of_runs(residuals, outline, lines, weights)
        run_tolerance = max(run_px, 2.0 * np.median(np.abs(runs)))
        for n in range(len(weights)):
            weight, residual = weights[n] * lines.information[n], residuals[n]
            if weight <= 0.0 or np.isnan(residual):
                continue
            # What is in front of the object moves the contour inward; only a background of its
            # colours moves it outward.
            tolerance = tolerance_px if residual > 0.0 else _INWARD * tolerance_px
            weight /= (1.0 + (residual / tolerance) ** 2) ** 2
            weight /= (1.0 + (runs[n] / run_tolerance) ** 2) ** 2
            for i in range(6):
                slope = slopes[n, i]
                b[i] += weight * slope * residual
                for k in range(i + 1):
                    A[i, k] += weight * slope * slopes[n, k]
        factor_spd(A)
        solve_factored(A, b)
        T = moved_pose(T, b)
    return T


@njit(cache=True)
def means_of_runs(
    residuals: FloatArray, outline: Outline, lines: ContourLines, weights: FloatArray
) -> FloatArray:
    """Return the weighted mean of the residuals of each line and its neighbours, (N,), px.

    Where what is behind the object has its colours, a run of lines errs alike, each by no more
    than noise: only their mean shows it.

    Args:
        residuals: how far outside the outline each line finds the contour, (N,), px.
        outline: where the lines are.
        lines: where they find the contour.
        weights: of the lines, (N,) 0 … 1.
    """
    means = np.zeros(len(residuals))
    for n in range(len(residuals)):
        total, information = 0.0, 0.0
        for side in (-1, 1):
            k = n if side > 0 else n - 1
            for _ in range(_BESIDE):
                if not 0 <= k < len(residuals):
                    break
                if np.abs(outline.points_px[k] - outline.points_px[n]).max() > _BESIDE_PX:
                    break
                weight = weights[k] * lines.information[k]
                total += weight * min(max(residuals[k], -_CLIPPED_PX), _CLIPPED_PX)
                information += weight
                k += side
        if information > 0.0:
            means[n] = total / information
    return means


@njit(cache=True)
def outline_motion(
    T: FloatArray, lens: FloatArray, outline: Outline
) -> tuple[FloatArray, FloatArray]:
    """Return how far the places of an outline move across it, and how that depends on the pose.

    Args:
        T: the pose that they move to, (4, 4).
        lens: packed camera, (11,).
        outline: where they are.

    Returns:
        outward motion (N,), px, NaN behind the camera; its derivative by (δp, δθ), (N, 6), px per
        m and rad.
    """
    count = len(outline.points)
    moved, slopes, rows = np.empty(count), np.empty((count, 6)), np.empty((2, 6))
    for n in range(count):
        nu, nv = outline.normals[n]
        u, v, _ = pixel_rows(T, lens, outline.points[n], rows)
        moved[n] = nu * (u - outline.points_px[n, 0]) + nv * (v - outline.points_px[n, 1])
        for i in range(6):
            slopes[n, i] = nu * rows[0, i] + nv * rows[1, i]
    return moved, slopes


@njit(cache=True)
def contour_points(
    outline: Outline,
    lines: ContourLines,
    found: BoolArray,
    enlarged: float,
    runs: FloatArray,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return points (M, 3), places (M, 2), covariances (M, 2, 2): one of each line found.

    A line tells where the contour is across it, not along it: a point with a long covariance.

    Args:
        outline: where the lines are.
        lines: where they find the contour.
        found: which of them did, (N,).
        enlarged: how much larger the covariances are, for neighbouring lines err together.
        runs: mean residual of each line and its neighbours, which they share, (N,), px.
    """
    points, measured = outline.points[found], outline.points_px[found]
    normals, offsets = outline.normals[found], lines.offsets_px[found]
    information, means = lines.information[found], runs[found]
    covariances = np.empty((len(points), 2, 2))
    for n in range(len(points)):
        measured[n] += offsets[n] * normals[n]
        across = enlarged / information[n] + 2.0 * _BESIDE * means[n] ** 2
        nu, nv = normals[n]
        covariances[n, 0, 0] = across * nu * nu + SLIDING_PX**2 * nv * nv
        covariances[n, 1, 1] = across * nv * nv + SLIDING_PX**2 * nu * nu
        covariances[n, 0, 1] = covariances[n, 1, 0] = (across - SLIDING_PX**2) * nu * nv
    return points, measured, covariances


def line_weights(lines: ContourLines) -> FloatArray:
    """Return how far each line is believed: not where something else is before the object."""
    return np.where(lines.usable, np.clip(lines.deep_odds - DEEP_ODDS, 0.0, 1.0), 0.0)


def misfit_of(residuals: FloatArray, lines: ContourLines, weights: FloatArray) -> float:
    """Return the weighted root mean square residual of the lines, px.

    Args:
        residuals: how far outside the outline each line finds the contour, (N,), px.
        lines: where they find the contour.
        weights: of the lines, (N,) 0 … 1.
    """
    information = weights * lines.information
    squares = np.minimum(np.nan_to_num(residuals) ** 2, _MOST_MISFIT_PX**2)
    total = float(information.sum())
    return float(np.sqrt(information @ squares / total)) if total > 0.0 else _MOST_MISFIT_PX


def rounds_for(
    T: FloatArray, lens: FloatArray, outline: Outline, covariance: FloatArray
) -> list[Round]:
    """Return the rounds of a fit, at first as coarse as three standard deviations need."""
    widest, rows = 0.0, np.empty((2, 6))
    for n in range(0, len(outline.points), 10):
        pixel_rows(T, lens, outline.points[n], rows)
        across = outline.normals[n] @ rows
        widest = max(widest, float(across @ covariance @ across))
    needed = 3.0 * np.sqrt(widest) / REACH
    first = int(np.clip(2 * np.ceil(0.5 * (needed - 1.0)) + 1, 1, _MOST_SCALE))
    return [*(Round(k, k * Round().tolerance_px) for k in range(first, 1, -2)), *FINE]


def shared_error(slopes: FloatArray, bias_px: float) -> FloatArray:
    """Return what a bias of the outline does to the pose, (6, 6): images do not average it out."""
    if len(slopes) < 6:
        return np.zeros((6, 6))
    size = np.sqrt(np.mean(slopes**2, axis=0))
    shown = size > _LEAST_SLOPE * size.max()  # the others are free, and are counted as such
    scale = np.where(shown, 1.0 / np.maximum(size, 1e-12), 0.0)
    scaled = slopes * scale
    inverse = np.linalg.inv(scaled.T @ scaled / len(slopes) + 1e-4 * np.eye(6))
    return np.asarray(bias_px**2 * inverse * np.outer(scale, scale))
