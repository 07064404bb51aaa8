"""Points in space from an image, and the pose that best aligns known points with them."""

import numpy as np

from vergence.arrays import FloatArray
from vergence.geometry import nearest_rotation, se3


def lifted(image: FloatArray, depth_m: FloatArray) -> FloatArray:
    """Return points in the camera frame, (M, 3), m.

    Args:
        image: normalized coordinates, (M, 2).
        depth_m: (M,).
    """
    return np.column_stack((image * depth_m[:, None], depth_m))


def aligned(points: FloatArray, seen: FloatArray) -> FloatArray:
    """Return the pose (4, 4) that best aligns points (M, 3) with measured ones, (M, 3)."""
    M = (seen - seen.mean(axis=0)).T @ (points - points.mean(axis=0))
    R = nearest_rotation(np.ascontiguousarray(M))
    T: FloatArray = se3(R, seen.mean(axis=0) - R @ points.mean(axis=0))
    return T
