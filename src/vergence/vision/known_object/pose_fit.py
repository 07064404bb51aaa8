"""The pose at which the edges of an object coincide with steps of the image.

Iterated, robustly weighted least squares on the distances across the edges. In each iteration,
samples are assigned to steps again, with a shrinking tolerance.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from vergence.arrays import BoolArray, FloatArray, IntArray
from vergence.geometry import moved_pose, pose_difference
from vergence.robot.positive_definite import factor_spd, solve_factored
from vergence.vision.known_object.edge_samples import EdgeSamples, Steps
from vergence.vision.known_object.projection import pixel_rows

INLIER = 2.5  # number of tolerances within which a step belongs to its edge
LEAST_SPREAD_PX = 0.15


class PoseFit(NamedTuple):
    """A pose and its support."""

    T: FloatArray  # (4, 4) pose of the object in the camera
    chosen: IntArray  # (N,) index of each sample's step; -1 for none
    residuals: FloatArray  # (N,) px, across the edge
    spread_px: float  # robust standard deviation of the residuals of assigned samples


@njit(cache=True)
def fit_pose(
    T_start: FloatArray,
    T_prior: FloatArray,
    prior: FloatArray,
    lens: FloatArray,
    samples: EdgeSamples,
    steps: Steps,
    widest_px: float,
    narrowest_px: float,
    iterations: int,
) -> PoseFit:
    """Fit the pose to the steps, linearised at the start.

    Args:
        T_start: initial pose, (4, 4).
        T_prior: the predicted pose, (4, 4).
        prior: information of the prediction's error (δp, δθ) along camera axes, (6, 6).
        lens: packed camera, (11,).
        samples: on the edges.
        steps: across each sample.
        widest_px: tolerance of the first iteration.
        narrowest_px: tolerance of the last iteration.
        iterations: number of iterations.
    """
    slopes, start = _linearized(T_start, lens, samples)
    moved = np.zeros(6)
    ahead = pose_difference(T_prior, T_start)
    shrink = (narrowest_px / widest_px) ** (1.0 / max(iterations - 1, 1))
    tolerance = widest_px
    for _ in range(iterations):
        A = prior.copy()
        b = prior @ (ahead - moved)
        certainty = 1.0 / tolerance**2
        for n in range(len(slopes)):
            here = start[n] + _dot(slopes[n], moved)
            j, residual, weight = _likeliest(here, steps.offsets[n], steps.weights[n], tolerance)
            if j < 0:
                continue
            for i in range(6):
                share = certainty * weight * slopes[n, i]
                b[i] += share * residual
                for k in range(i + 1):  # only the lower triangle is read
                    A[i, k] += share * slopes[n, k]
        factor_spd(A)
        solve_factored(A, b)
        moved += b
        tolerance *= shrink
    tolerance /= shrink
    chosen = np.empty(len(slopes), dtype=np.int64)
    residuals = np.empty(len(slopes))
    for n in range(len(slopes)):
        here = start[n] + _dot(slopes[n], moved)
        j, residuals[n], _ = _likeliest(here, steps.offsets[n], steps.weights[n], tolerance)
        chosen[n] = j
    belonging = np.abs(residuals[chosen >= 0])
    spread = 1.4826 * np.median(belonging) if len(belonging) else np.inf
    return PoseFit(moved_pose(T_start, moved), chosen, residuals, max(spread, LEAST_SPREAD_PX))


@njit(cache=True)
def _linearized(
    T: FloatArray, lens: FloatArray, samples: EdgeSamples
) -> tuple[FloatArray, FloatArray]:
    """Return the motion of each sample across its edge by (δp, δθ), (N, 6), and its position, (N,).

    NaN for samples behind the camera, to which no step is assigned.
    """
    slopes, places = np.empty((len(samples.edge), 6)), np.empty(len(samples.edge))
    rows = np.empty((2, 6))
    for n in range(len(slopes)):
        nu, nv = samples.normals[n, 0], samples.normals[n, 1]
        u, v, _ = pixel_rows(T, lens, samples.points[n], rows)
        places[n] = nu * (u - samples.points_px[n, 0]) + nv * (v - samples.points_px[n, 1])
        for i in range(6):
            slopes[n, i] = nu * rows[0, i] + nv * rows[1, i]
    return slopes, places


@njit(cache=True)
def _dot(a: FloatArray, b: FloatArray) -> float:
    total: float = a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3] + a[4] * b[4] + a[5] * b[5]
    return total


@njit(cache=True, error_model="numpy")
def _likeliest(
    here: float, offsets: FloatArray, weights: FloatArray, tolerance: float
) -> tuple[int, float, float]:
    """Return the most likely step of a sample, its residual, px, and its weight.

    The weight is Tukey's times that of the step; the step is -1 if none is close enough.
    """
    farthest = (INLIER * tolerance) ** 2
    best, step, residual = 0.0, -1, np.nan
    for j in range(len(offsets)):
        miss = offsets[j] - here
        inside = farthest - miss * miss
        weight = weights[j] * inside * inside
        if inside > 0.0 and weight > best:
            best, step, residual = weight, j, miss
    return step, residual, best / farthest**2


@njit(cache=True)
def shifted(T: FloatArray, lens: FloatArray, dx: float, dy: float) -> FloatArray:
    """Return the pose moved so that the object's image shifts by (dx, dy) px."""
    step = np.zeros(6)
    step[0] = dx * T[2, 3] / lens[0]
    step[1] = dy * T[2, 3] / lens[1]
    return moved_pose(T, step)


@njit(cache=True)
def agreeing(fit: PoseFit, steps: Steps, likeness: float, tolerance_px: float) -> BoolArray:
    """Return which samples found their edge: a step near it that looks as remembered."""
    found = np.zeros(len(fit.chosen), dtype=np.bool_)
    for n in range(len(found)):
        j = fit.chosen[n]
        if j >= 0 and abs(fit.residuals[n]) <= tolerance_px:
            alike = steps.likeness[n, j]
            found[n] = np.isnan(alike) or alike >= likeness
    return found
