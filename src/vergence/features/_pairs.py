"""Points that are taken in pairs, as the ends of segments."""

import numpy as np

from vergence.arrays import FloatArray
from vergence.errors import InputError


def ends(name: str, points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the first and the second points of pairs, each (M/2, 2).

    Raises:
        InputError: if a point is left over, or the points of a pair coincide.
    """
    if len(points) % 2 or not len(points):
        raise InputError(name, "points", f"{len(points)} points", "an even number: pairs of ends")
    first, second = points[0::2], points[1::2]
    if not np.linalg.norm(second - first, axis=1).all():
        raise InputError(name, "points", "two ends at one place", "ends that differ")
    return first, second
