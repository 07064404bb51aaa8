"""Features chosen so far apart that their windows do not overlap, as [Lippiello2005] has it."""

import numpy as np

from vergence.arrays import BoolArray, FloatArray


def keep_apart(
    visible: BoolArray, points_px: FloatArray, held: BoolArray, distance_px: float
) -> BoolArray:
    """Return which visible features of each image to choose from, (C, M).

    One after the other, those chosen last time first, each is left out if it is closer than the
    distance to one that stays.

    Args:
        visible: (C, M).
        points_px: predicted places, (C, M, 2).
        held: chosen last time, (C, M).
        distance_px: least distance in an image; 0 keeps all.
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
