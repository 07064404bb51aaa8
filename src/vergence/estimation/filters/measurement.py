"""The measurement model: how image points depend on the target's pose.

The pose error is (δp, δθ) along world axes: p = p̂ + δp, R = exp(δθ) R̂. With p_c the point in
the camera, s = (x/z, y/z), a = R̂ p_o and g_u = (R_cw[0] - u R_cw[2]) / z,

    ∂u/∂δp = g_u,  ∂u/∂δθ = a × g_u,

and the same for v with R_cw[1]: [Lippiello2005] eq. (14) to (18) without roll, pitch and yaw.

A *whitened* measurement has two rows [H | r] a point, (2M, 7), scaled by the inverse Cholesky
factor of its covariance, so that its noise is the identity.
"""

import numpy as np
from numba import njit

from vergence.arrays import BoolArray, FloatArray

POSE = 6  # columns that depend on the pose; the one after them holds the residual


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def point_rows(
    T_world_target: FloatArray, T_camera_world: FloatArray, point: FloatArray, rows: FloatArray
) -> float:
    """Fill rows (2, 7) with [∂s/∂(δp, δθ) | s] of one target point; return its depth, m."""
    T, C = T_world_target, T_camera_world
    ax = T[0, 0] * point[0] + T[0, 1] * point[1] + T[0, 2] * point[2]
    ay = T[1, 0] * point[0] + T[1, 1] * point[1] + T[1, 2] * point[2]
    az = T[2, 0] * point[0] + T[2, 1] * point[1] + T[2, 2] * point[2]
    px, py, pz = ax + T[0, 3], ay + T[1, 3], az + T[2, 3]
    depth: float = C[2, 0] * px + C[2, 1] * py + C[2, 2] * pz + C[2, 3]
    inverse = 1.0 / depth if depth != 0.0 else np.inf
    for i in range(2):
        s = (C[i, 0] * px + C[i, 1] * py + C[i, 2] * pz + C[i, 3]) * inverse
        gx = (C[i, 0] - s * C[2, 0]) * inverse
        gy = (C[i, 1] - s * C[2, 1]) * inverse
        gz = (C[i, 2] - s * C[2, 2]) * inverse
        rows[i, 0], rows[i, 1], rows[i, 2] = gx, gy, gz
        rows[i, 3] = ay * gz - az * gy
        rows[i, 4] = az * gx - ax * gz
        rows[i, 5] = ax * gy - ay * gx
        rows[i, 6] = s
    return depth


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def whiten(rows: FloatArray, covariance: FloatArray) -> None:
    """Multiply two rows by L⁻¹, where L Lᵀ is their covariance (2, 2)."""
    l00 = np.sqrt(covariance[0, 0])
    l10 = covariance[1, 0] / l00
    l11 = np.sqrt(covariance[1, 1] - l10 * l10)
    for j in range(rows.shape[1]):
        rows[0, j] /= l00
        rows[1, j] = (rows[1, j] - l10 * rows[0, j]) / l11


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def whitened_rows(
    T_world_target: FloatArray,
    T_camera_world: FloatArray,
    points: FloatArray,
    measured: FloatArray,
    covariance: FloatArray,
) -> FloatArray:
    """Return the whitened measurement of points in any number of images, (2M, 7).

    A point behind the camera gets an infinite residual, which no gate lets through.

    Args:
        T_world_target: the predicted pose, (4, 4).
        T_camera_world: inverse pose of each point's camera at the exposure, (M, 4, 4).
        points: in the target's frame, (M, 3), m.
        measured: normalized coordinates, (M, 2).
        covariance: of the measured points, normalized, (M, 2, 2), positive definite.
    """
    rows = np.empty((2 * len(points), POSE + 1))
    for n in range(len(points)):
        pair = rows[2 * n : 2 * n + 2]
        depth = point_rows(T_world_target, T_camera_world[n], points[n], pair)
        pair[0, POSE] = measured[n, 0] - pair[0, POSE]
        pair[1, POSE] = measured[n, 1] - pair[1, POSE]
        whiten(pair, covariance[n])
        if not depth > 0.0:
            pair[:, :POSE] = 0.0
            pair[:, POSE] = np.inf
    return rows


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def _pair_square(pair: FloatArray, P: FloatArray, sign: float) -> tuple[float, float]:
    """Return rᵀ S⁻¹ r and det S of two whitened rows (2, 7), S = I + sign · H P Hᵀ."""
    s00, s01, s11 = 1.0, 0.0, 1.0
    for j in range(POSE):
        a, b = 0.0, 0.0
        for i in range(POSE):
            a += pair[0, i] * P[i, j]
            b += pair[1, i] * P[i, j]
        s00 += sign * a * pair[0, j]
        s01 += sign * a * pair[1, j]
        s11 += sign * b * pair[1, j]
    determinant: float = s00 * s11 - s01 * s01
    r0, r1 = pair[0, POSE], pair[1, POSE]
    return (s11 * r0 * r0 - 2.0 * s01 * r0 * r1 + s00 * r1 * r1) / determinant, determinant


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def mahalanobis_squared(rows: FloatArray, pose_covariance: FloatArray) -> FloatArray:
    """Return rᵀ (H P Hᵀ + I)⁻¹ r of each pair of whitened rows, (M,).

    Args:
        rows: whitened measurement, (2M, 7).
        pose_covariance: P, at least (6, 6); only its first six rows and columns are used.
    """
    squares = np.empty(len(rows) // 2)
    for n in range(len(squares)):
        square, _ = _pair_square(rows[2 * n : 2 * n + 2], pose_covariance, 1.0)
        squares[n] = square if square >= 0.0 else np.inf  # what is not a number fits nothing
    return squares


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def deletion_squares(
    rows: FloatArray, kept: BoolArray, correction: FloatArray, updated: FloatArray
) -> FloatArray:
    """Return how far each kept point is from what all the others and the prediction say, (M,).

    The normalised innovation squared would fall by rᵀ (I - H P⁺ Hᵀ)⁻¹ r, of the residuals r left
    after the update, if the point had been left out.

    Args:
        rows: whitened measurement, (2M, 7).
        kept: points that were used, (M,); 0 for the others.
        correction: what the update added to the state, at least (6,).
        updated: P⁺, at least (6, 6).
    """
    squares = np.zeros(len(kept))
    pair = np.empty((2, POSE + 1))
    for n in range(len(kept)):
        if kept[n]:
            for i in range(2):
                pair[i] = rows[2 * n + i]
                for k in range(POSE):
                    pair[i, POSE] -= pair[i, k] * correction[k]
            square, determinant = _pair_square(pair, updated, -1.0)
            if determinant > 1e-9:  # else nothing but this point tells about some direction
                squares[n] = square
    return squares
