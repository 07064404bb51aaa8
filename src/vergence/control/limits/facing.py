"""The limit that keeps a camera in front of a flat target, as a row C q̇ ≥ d."""

import numpy as np
from numba import njit

from vergence.arrays import FloatArray
from vergence.control.limits._rows import DEPTH
from vergence.geometry import FLAT


@njit(cache=True, error_model="numpy")
def facing_row(
    features: FloatArray, J_camera: FloatArray, least_sine: float, approach_rate: float
) -> tuple[FloatArray, FloatArray]:
    """Return the row that keeps the camera before the plane of the features, C (1, n) and d (1,).

    With the features' middle c and the plane's normal o towards the camera, both in its frame, the
    plane is seen at the sine h = -o·c/‖c‖, and for a stationary target
    ḣ = (o + h c/‖c‖)·v/‖c‖. The row is the barrier ḣ ≥ -γ (h - h_min). Features that are not flat,
    as they are believed, give none: C (0, n) and d (0,).

    Args:
        features: of `pack_features`, (M, 7).
        J_camera: (6, n).
        least_sine: h_min.
        approach_rate: γ, 1/s.
    """
    M, n = len(features), J_camera.shape[1]
    none = np.zeros((0, n)), np.zeros(0)
    if M < 3:
        return none
    X, c = np.empty((M, 3)), np.zeros(3)
    for j in range(M):
        depth = features[j, DEPTH]
        if not depth > 0.0:
            return none
        X[j, 0], X[j, 1], X[j, 2] = features[j, 0] * depth, features[j, 1] * depth, depth
        c += X[j] / M
    S = np.zeros((3, 3))
    for j in range(M):
        for a in range(3):
            for b in range(3):
                S[a, b] += (X[j, a] - c[a]) * (X[j, b] - c[b])
    if not np.isfinite(S).all():
        return none
    extent, axes = np.linalg.eigh(S)
    if extent[1] <= 1e-12 * extent[2] or extent[0] > FLAT * FLAT * extent[1]:
        return none
    o, distance, h = np.empty(3), np.sqrt(np.sum(c * c)), 0.0
    for a in range(3):
        o[a] = axes[a, 0]
        h -= o[a] * c[a] / distance
    if h < 0.0:
        o, h = -o, -h
    C, d = np.zeros((1, n)), np.empty(1)
    for a in range(3):
        slope = (o[a] + h * c[a] / distance) / distance
        for i in range(n):
            C[0, i] += slope * J_camera[a, i]
    d[0] = -approach_rate * (h - least_sine)
    return C, d
