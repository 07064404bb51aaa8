"""The plane that points lie on, from their depths."""

import numpy as np

from vergence.arrays import FloatArray


def inverse_depth_plane(points: FloatArray, depth_m: FloatArray) -> FloatArray:
    """Return (A, B, C), 1/m, such that 1/Z = A x + B y + C on the plane of the points.

    Args:
        points: normalized coordinates, (M, 2).
        depth_m: Z of each, (M,). For collinear points, the plane with the smallest slope is
            returned.
    """
    centre = points.mean(axis=0)
    inverse = 1.0 / depth_m
    slope = np.linalg.lstsq(points - centre, inverse - inverse.mean(), rcond=1e-9)[0]
    return np.append(slope, inverse.mean() - slope @ centre)
