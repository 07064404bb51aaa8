"""The pose under which the outline of an object lies where lines across it find the contour."""

import numpy as np
from numba import njit

from vergence.arrays import BoolArray, FloatArray
from vergence.robot.positive_definite import factor_spd, solve_factored
from vergence.vision.known_object.contour_lines import ContourLines
from vergence.vision.known_object.pose_fit import moved_pose, pose_difference
from vergence.vision.known_object.projection import pixel_rows
from vergence.vision.known_object.silhouette import Outline

_INWARD = 0.6  # tolerance inward, as a share of that outward
SLIDING_PX = 100.0  # standard deviation along the contour


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
    iterations: int,
) -> FloatArray:
    """Return the pose (4, 4) that fits the lines, by Newton steps on their robust squares.

    Args:
        T_start: the pose of the outline, (4, 4).
        T_prior: the predicted pose, (4, 4).
        prior: information of the prediction's error (δp, δθ) along camera axes, (6, 6).
        lens: packed camera, (11,).
        outline: where the lines are.
        lines: where they find the contour.
        weights: of the lines, (N,) 0 … 1.
        tolerance_px: residual outward at which a line counts a quarter.
        iterations: how many steps.
    """
    T = T_start.copy()
    rows = np.empty((2, 6))
    for _ in range(iterations):
        A, b = prior.copy(), prior @ pose_difference(T_prior, T)
        for n in range(len(weights)):
            weight = weights[n] * lines.information[n]
            if weight <= 0.0:
                continue
            nu, nv = outline.normals[n]
            u, v, depth = pixel_rows(T, lens, outline.points[n], rows)
            if not depth > 0.0:
                continue
            moved = nu * (u - outline.points_px[n, 0]) + nv * (v - outline.points_px[n, 1])
            residual = lines.offsets_px[n] - moved
            # What is in front of the object moves the contour inward, nothing moves it outward.
            tolerance = tolerance_px if residual > 0.0 else _INWARD * tolerance_px
            weight /= (1.0 + (residual / tolerance) ** 2) ** 2
            for i in range(6):
                slope = nu * rows[0, i] + nv * rows[1, i]
                b[i] += weight * slope * residual
                for k in range(i + 1):
                    A[i, k] += weight * slope * (nu * rows[0, k] + nv * rows[1, k])
        factor_spd(A)
        solve_factored(A, b)
        T = moved_pose(T, b)
    return T


@njit(cache=True)
def residuals_of(
    T: FloatArray, lens: FloatArray, outline: Outline, lines: ContourLines
) -> FloatArray:
    """Return how far outside the outline under a pose each line finds the contour, (N,), px."""
    residuals, rows = np.empty(len(lines.offsets_px)), np.empty((2, 6))
    for n in range(len(residuals)):
        u, v, _ = pixel_rows(T, lens, outline.points[n], rows)
        moved = outline.normals[n, 0] * (u - outline.points_px[n, 0])
        moved += outline.normals[n, 1] * (v - outline.points_px[n, 1])
        residuals[n] = lines.offsets_px[n] - moved
    return residuals


@njit(cache=True)
def contour_points(
    outline: Outline, lines: ContourLines, found: BoolArray, enlarged: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return points (M, 3), places (M, 2), covariances (M, 2, 2): one of each line found.

    A line tells where the contour is across it, not along it: a point with a long covariance.

    Args:
        outline: where the lines are.
        lines: where they find the contour.
        found: which of them did, (N,).
        enlarged: how much larger the covariances are, for neighbouring lines err together.
    """
    points, measured = outline.points[found], outline.points_px[found]
    normals, offsets = outline.normals[found], lines.offsets_px[found]
    information = lines.information[found]
    covariances = np.empty((len(points), 2, 2))
    for n in range(len(points)):
        measured[n] += offsets[n] * normals[n]
        across = enlarged / information[n]
        nu, nv = normals[n]
        covariances[n, 0, 0] = across * nu * nu + SLIDING_PX**2 * nv * nv
        covariances[n, 1, 1] = across * nv * nv + SLIDING_PX**2 * nu * nu
        covariances[n, 0, 1] = covariances[n, 1, 0] = (across - SLIDING_PX**2) * nu * nv
    return points, measured, covariances


@njit(cache=True)
def contour_slopes(T: FloatArray, lens: FloatArray, outline: Outline) -> FloatArray:
    """Return how each place moves across the outline with (δp, δθ), (N, 6), px per m and rad."""
    slopes, rows = np.empty((len(outline.points), 6)), np.empty((2, 6))
    for n in range(len(slopes)):
        pixel_rows(T, lens, outline.points[n], rows)
        for i in range(6):
            slopes[n, i] = outline.normals[n, 0] * rows[0, i] + outline.normals[n, 1] * rows[1, i]
    return slopes
