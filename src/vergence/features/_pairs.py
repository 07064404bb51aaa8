"""Points taken in pairs, as the ends of segments."""

import numpy as np

from vergence.arrays import FloatArray
from vergence.errors import InputError


def ends(name: str, points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the first and the second points of the pairs, each (M/2, 2).

    Raises:
        InputError: if the number of points is odd, or the points of a pair coincide.
    """
    if len(points) % 2 or not len(points):
        raise InputError(name, "points", f"{len(points)} points", "an even number, two per segment")
    first, second = points[0::2], points[1::2]
    if not np.linalg.norm(second - first, axis=1).all():
        raise InputError(name, "points", "two ends of a segment that coincide", "distinct ends")
    return first, second
