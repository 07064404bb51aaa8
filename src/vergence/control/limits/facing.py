"""The limit that keeps a camera in front of faces of its target, as rows C q̇ ≥ d."""

import numpy as np
from numba import njit

from vergence.arrays import FloatArray
from vergence.control.limits._rows import DEPTH
from vergence.geometry import FLAT


@njit(cache=True, error_model="numpy")
def facing_rows(
    faces: FloatArray, J_camera: FloatArray, least_sine: float, approach_rate: float
) -> tuple[FloatArray, FloatArray]:
    """Return the rows that keep the camera in front of faces, C (F, n) and d (F,).

    With the centre c and outward normal o of a face, both in the camera frame, it is seen at the
    sine h = -o·c/‖c‖, and for a stationary target ḣ = (o + h c/‖c‖)·v/‖c‖. The row is the barrier
    ḣ ≥ -γ (h - h_min).

    Args:
        faces: c and o of each, (F, 6).
        J_camera: (6, n).
        least_sine: h_min.
        approach_rate: γ, 1/s.
    """
    n = J_camera.shape[1]
    C, d = np.zeros((len(faces), n)), np.empty(len(faces))
    for f in range(len(faces)):
        c, o = faces[f, :3], faces[f, 3:]
        distance, h = np.sqrt(np.sum(c * c)), 0.0
        for a in range(3):
            h -= o[a] * c[a] / distance
        for a in range(3):
            slope = (o[a] + h * c[a] / distance) / distance
            for i in range(n):
                C[f, i] += slope * J_camera[a, i]
        d[f] = -approach_rate * (h - least_sine)
    return C, d


@njit(cache=True, error_model="numpy")
def flat_face(features: FloatArray) -> FloatArray:
    """Return the visible side of coplanar features, c and o in the camera frame, (1, 6).

    Features whose believed positions are not coplanar have none: (0, 6).

    Args:
        features: from `pack_features`, (M, 7).
    """
    M, none = len(features), np.zeros((0, 6))
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
    face = np.empty((1, 6))
    face[0, :3] = c
    towards = 1.0 if np.sum(axes[:, 0] * c) <= 0.0 else -1.0
    for a in range(3):
        face[0, 3 + a] = towards * axes[a, 0]
    return face
