"""Points in space from an image, and the pose that best aligns known points with them."""

import numpy as np
from numba import njit

from vergence.arrays import FloatArray
from vergence.geometry import nearest_rotation, se3

FEWEST_TURNED = 3  # points that determine an orientation
_ON_LINE = 1e-3  # of the extent along a line: points within this distance are as good as on it


@njit(cache=True, error_model="numpy")
def lifted(image: FloatArray, depth_m: FloatArray) -> FloatArray:
    """Return points in the camera frame, (M, 3), m.

    Args:
        image: normalized coordinates, (M, 2).
        depth_m: (M,).
    """
    points = np.empty((len(image), 3))
    for j in range(len(image)):
        points[j, 0], points[j, 1] = image[j, 0] * depth_m[j], image[j, 1] * depth_m[j]
        points[j, 2] = depth_m[j]
    return points


@njit(cache=True, error_model="numpy")
def aligned(points: FloatArray, seen: FloatArray) -> FloatArray:
    """Return the pose (4, 4) that best aligns points (M, 3) with measured ones, (M, 3)."""
    middle, seen_middle, M = np.zeros(3), np.zeros(3), np.zeros((3, 3))
    for j in range(len(points)):
        middle += points[j] / len(points)
        seen_middle += seen[j] / len(points)
    for j in range(len(points)):
        for a in range(3):
            for b in range(3):
                M[a, b] += (seen[j, a] - seen_middle[a]) * (points[j, b] - middle[b])
    R = nearest_rotation(M)
    t = seen_middle
    for a in range(3):
        for b in range(3):
            t[a] -= R[a, b] * middle[b]
    return se3(R, t)  # type: ignore[no-any-return]


@njit(cache=True, error_model="numpy")
def fixes_orientation(points: FloatArray) -> bool:
    """Return whether points (M, 3) determine an orientation: three or more, not on one line."""
    if len(points) < FEWEST_TURNED:
        return False
    middle, S = np.zeros(3), np.zeros((3, 3))
    for j in range(len(points)):
        middle += points[j] / len(points)
    for j in range(len(points)):
        for a in range(3):
            for b in range(3):
                S[a, b] += (points[j, a] - middle[a]) * (points[j, b] - middle[b])
    if not np.isfinite(S).all():
        return False
    squares = np.linalg.eigvalsh(S)  # of the extents, ascending
    return bool(squares[1] > _ON_LINE * _ON_LINE * squares[2])
