"""The pose under which the edges of an object run along steps of the image.

Iterated, robustly weighted least squares on the distances across the edges. Which of its steps a
sample belongs to is decided anew in each iteration, with a tolerance that shrinks.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from vergence.arrays import BoolArray, FloatArray, IntArray
from vergence.geometry import se3, so3_exp, so3_log
from vergence.vision.known_object.edge_samples import EdgeSamples, Steps
from vergence.vision.known_object.projection import pixel_rows

INLIER = 2.5  # tolerances within which a step belongs to its edge
LEAST_SPREAD_PX = 0.15


class PoseFit(NamedTuple):
    """A pose and what supports it."""

    T: FloatArray  # (4, 4) pose of the object in the camera
    chosen: IntArray  # (N,) which step each sample belongs to; -1 for none
    residuals: FloatArray  # (N,) px, across the edge
    spread_px: float  # robust standard deviation of the residuals that belong


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
    """Fit the pose to the steps.

    Args:
        T_start: where to begin, (4, 4).
        T_prior: the predicted pose, (4, 4).
        prior: information of the prediction's error (δp, δθ) along camera axes, (6, 6).
        lens: packed camera, (11,).
        samples: on the edges.
        steps: across each sample.
        widest_px: tolerance of the first iteration.
        narrowest_px: tolerance of the last.
        iterations: how many.
    """
    T = T_start.copy()
    rows = np.empty((2, 6))
    chosen = np.empty(len(samples.edge), dtype=np.int64)
    residuals = np.empty(len(samples.edge))
    shrink = (narrowest_px / widest_px) ** (1.0 / max(iterations - 1, 1))
    tolerance = widest_px
    for _ in range(iterations):
        A = prior.copy()
        b = prior @ _difference(T_prior, T)
        for n in range(len(samples.edge)):
            j, residual = _assign(T, lens, samples, steps, n, tolerance, rows)
            chosen[n], residuals[n] = j, residual
            if j < 0:
                continue
            outside = residual / (INLIER * tolerance)
            weight = steps.weights[n, j] * (1.0 - outside * outside) ** 2 / tolerance**2
            nu, nv = samples.normals[n, 0], samples.normals[n, 1]
            for i in range(6):
                gi = nu * rows[0, i] + nv * rows[1, i]
                b[i] += weight * gi * residual
                for k in range(i + 1):
                    A[i, k] += weight * gi * (nu * rows[0, k] + nv * rows[1, k])
        for i in range(6):
            for k in range(i):
                A[k, i] = A[i, k]
        step = np.linalg.solve(A, b)
        T = _moved(T, step)  # type: ignore[arg-type]
        tolerance *= shrink
    tolerance /= shrink
    for n in range(len(samples.edge)):
        chosen[n], residuals[n] = _assign(T, lens, samples, steps, n, tolerance, rows)
    belonging = np.abs(residuals[chosen >= 0])
    spread = 1.4826 * np.median(belonging) if len(belonging) else np.inf
    return PoseFit(T, chosen, residuals, max(spread, LEAST_SPREAD_PX))


@njit(cache=True)
def _assign(
    T: FloatArray,
    lens: FloatArray,
    samples: EdgeSamples,
    steps: Steps,
    n: int,
    tolerance: float,
    rows: FloatArray,
) -> tuple[int, float]:
    """Return the step that a sample most likely belongs to, or -1, and its residual, px.

    Fills rows with the Jacobian of the sample's pixel.
    """
    u, v, z = pixel_rows(T, lens, samples.points[n], rows)
    if not z > 0.0:
        return -1, np.nan
    p, normal = samples.points_px[n], samples.normals[n]
    here = normal[0] * (u - p[0]) + normal[1] * (v - p[1])
    best, step, residual = 0.0, -1, np.nan
    for j in range(steps.offsets.shape[1]):
        miss = steps.offsets[n, j] - here
        if abs(miss) < INLIER * tolerance:
            likely = steps.weights[n, j] * np.exp(-0.5 * (miss / tolerance) ** 2)
            if likely > best:
                best, step, residual = likely, j, miss
    return step, residual


@njit(cache=True)
def _difference(T_a: FloatArray, T_b: FloatArray) -> FloatArray:
    """Return (δp, δθ) that moves pose b to a: t_a - t_b, log(R_a R_bᵀ)."""
    difference = np.empty(6)
    difference[:3] = T_a[:3, 3] - T_b[:3, 3]
    turn = np.eye(4)
    for i in range(3):
        for j in range(3):
            turn[i, j] = T_a[i, 0] * T_b[j, 0] + T_a[i, 1] * T_b[j, 1] + T_a[i, 2] * T_b[j, 2]
    difference[3:] = so3_log(turn)
    return difference


@njit(cache=True)
def _moved(T: FloatArray, step: FloatArray) -> FloatArray:
    """Return the pose moved by (δp, δθ)."""
    E = so3_exp(step[3:])
    R = np.zeros((3, 3))
    for i in range(3):
        for j in range(3):
            for k in range(3):
                R[i, j] += E[i, k] * T[k, j]
    return se3(R, T[:3, 3] + step[:3])


@njit(cache=True)
def shifted(T: FloatArray, lens: FloatArray, dx: float, dy: float) -> FloatArray:
    """Return the pose moved so that the object's image shifts by (dx, dy) px."""
    step = np.zeros(6)
    step[0] = dx * T[2, 3] / lens[0]
    step[1] = dy * T[2, 3] / lens[1]
    return _moved(T, step)


@njit(cache=True)
def agreeing(fit: PoseFit, steps: Steps, likeness: float, tolerance_px: float) -> BoolArray:
    """Tell which samples found their edge: a step near it that looks as remembered."""
    found = np.zeros(len(fit.chosen), dtype=np.bool_)
    for n in range(len(found)):
        j = fit.chosen[n]
        if j >= 0 and abs(fit.residuals[n]) <= tolerance_px:
            alike = steps.likeness[n, j]
            found[n] = np.isnan(alike) or alike >= likeness
    return found
