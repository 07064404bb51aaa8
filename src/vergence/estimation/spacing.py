"""Selection of features whose windows do not overlap, as in [Lippiello2005]."""

import numpy as np

from vergence.arrays import BoolArray, FloatArray


def keep_apart(
    visible: BoolArray, points_px: FloatArray, held: BoolArray, distance_px: float
) -> BoolArray:
    """Return which visible features of each image to select from, (C, M).

    In sequence, with those selected last time first, each feature closer than the distance to an
    accepted one is rejected.

    Args:
        visible: (C, M).
        points_px: predicted positions, (C, M, 2).
        held: selected last time, (C, M).
        distance_px: smallest distance in an image; 0 accepts all.
    """
    if distance_px <= 0.0:
        return visible
    kept = np.zeros_like(visible)
    for camera in range(len(visible)):
        places = points_px[camera]
        numbers = np.flatnonzero(visible[camera])
        for n in numbers[np.argsort(~held[camera, numbers], kind="stable")]:
            off = places[kept[camera]] - places[n]
            kept[camera, n] = bool((np.hypot(off[:, 0], off[:, 1]) >= distance_px).all())
    return kept
