"""How strongly each motion of a camera moves its features in the image."""

from typing import NamedTuple

import numpy as np

from vergence.arrays import FloatArray
from vergence.features import interaction_matrix_points


class CameraDirections(NamedTuple):
    """Directions of camera motion, the best conditioned first: [Nelson1995] section 2.2.

    Their rate is the root mean square flow of the features for a rotation of 1 rad or a translation
    by the features' depth; at the image centre, both move a feature equally.
    """

    rate_px: FloatArray  # (6,) descending: roots of the eigenvalues of BᵀB
    directions: FloatArray  # (6, 6) rows (x, y, z, rx, ry, rz) of length 1: its eigenvectors
    axis_px: FloatArray  # (6,) the rate along each axis of the camera


def camera_directions(
    points: FloatArray, depth_m: FloatArray, focal_px: FloatArray
) -> CameraDirections:
    """Return the directions of camera motion, sorted by how well the features determine them.

    Args:
        points: normalized coordinates of the features, (M, 2).
        depth_m: their depths, (M,).
        focal_px: (fx, fy).
    """
    L = interaction_matrix_points(points, depth_m).reshape(len(points), 2, 6)
    B = (L * np.asarray(focal_px)[:, None]).reshape(-1, 6)
    B[:, :3] *= float(np.mean(depth_m))
    square = B.T @ B / len(points)
    values, vectors = np.linalg.eigh(square)
    falling = np.sqrt(np.maximum(values[::-1], 0.0))
    directions = np.ascontiguousarray(vectors.T[::-1])
    return CameraDirections(falling, directions, np.sqrt(np.diag(square)))
