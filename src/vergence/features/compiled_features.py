"""Features by number: for kernels that are compiled once for all of them."""

from collections.abc import Mapping

import numpy as np
from numba import njit

from vergence.arrays import FloatArray
from vergence.features.centre import Centre
from vergence.features.feature import Feature
from vergence.features.interaction import interaction_matrix_points
from vergence.features.log_depth import LogDepth
from vergence.features.points import Points

POINTS, CENTRE, LOG_DEPTH = range(3)
COMPILED_FEATURES: Mapping[type[Feature], int] = {
    Points: POINTS,
    Centre: CENTRE,
    LogDepth: LOG_DEPTH,
}


@njit(cache=True, error_model="numpy")
def feature_value(feature: int, points: FloatArray, depth_m: FloatArray) -> FloatArray:
    """Return s (k,) of points (M, 2) at depths (M,), m, as `Feature.value` does."""
    if feature == CENTRE:
        return np.array([points[:, 0].mean(), points[:, 1].mean()])
    if feature == LOG_DEPTH:
        return np.array([np.log(depth_m.mean())])
    return points.flatten()


@njit(cache=True, error_model="numpy")
def feature_interaction(feature: int, points: FloatArray, depth_m: FloatArray) -> FloatArray:
    """Return L (k, 6) of points (M, 2) at depths (M,), m, as `Feature.interaction` does."""
    L = interaction_matrix_points(points, depth_m)
    if feature == CENTRE:
        rows = np.zeros((2, 6))
        for r in range(len(L)):
            rows[r % 2] += L[r] / len(points)
        return rows
    if feature == LOG_DEPTH:
        row, total = np.zeros((1, 6)), depth_m.sum()
        row[0, 2] = -len(points) / total
        row[0, 3] = -(points[:, 1] * depth_m).sum() / total
        row[0, 4] = (points[:, 0] * depth_m).sum() / total
        return row
    return L


@njit(cache=True, error_model="numpy")
def feature_drift(feature: int, flow: FloatArray) -> FloatArray:
    """Return ∂s/∂t (k,) for image velocities of the points (M, 2), 1/s, at constant depth."""
    if feature == CENTRE:
        return np.array([flow[:, 0].mean(), flow[:, 1].mean()])
    if feature == LOG_DEPTH:
        return np.zeros(1)
    return flow.flatten()
