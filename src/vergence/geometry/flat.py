"""Coplanar points: the plane they lie in, and the side of it that a camera sees."""

import numpy as np

from vergence.arrays import FloatArray

FLAT = 0.01  # fraction of the smaller extent: points within this distance of a plane are flat


def flat_normal(points: FloatArray) -> FloatArray | None:
    """Return the unit normal (3,) of the plane that points (N, 3) lie in.

    Returns:
        The normal, or None if the points are not flat, lie on a line, or are fewer than three.
    """
    if len(points) < 3:
        return None
    _, extent, axes = np.linalg.svd(points - points.mean(axis=0), full_matrices=False)
    if extent[1] <= 1e-6 * extent[0] or extent[2] > FLAT * extent[1]:
        return None
    return np.array(axes[2])
