"""Warnings about a calibration."""

from collections.abc import Sequence

import numpy as np

from vergence.arrays import FloatArray
from vergence.camera.calibration.sighting import Sighting

_GRID = (8, 6)  # fields of the image in which corners are searched for
_TOO_SMALL = 3.0  # times: leaving images out against the normal equations


def coverage(sightings: Sequence[Sighting], width: int, height: int) -> float:
    """Return the share of the image's fields with at least one corner in some image."""
    pixels = np.concatenate([seen.points_px for seen in sightings])
    fields = np.floor(pixels / (width, height) * _GRID).astype(int)
    fields = np.clip(fields, 0, np.array(_GRID) - 1)
    return len(np.unique(fields, axis=0)) / (_GRID[0] * _GRID[1])


def jackknife_warnings(deviations: FloatArray, jackknife: FloatArray) -> list[str]:
    """Return a warning if leaving images out moves a result more than its deviations say."""
    known = deviations > 0.0
    if not known.any():
        return []
    ratio = float(np.median(jackknife[known] / deviations[known]))
    if ratio < _TOO_SMALL:
        return []
    return [
        f"leaving out images changes the result {ratio:.0f} times as much as the deviations state: "
        "errors are not independent (a bent board, another lens model); trust the "
        "larger deviations"
    ]
