"""Weights of the rendered moments in each image row: rolling shutter and motion blur."""

import numpy as np

from vergence.arrays import FloatArray
from vergence.cell.schema import ImagingTable


def row_weights(moments_s: FloatArray, rows: int, imaging: ImagingTable) -> FloatArray:
    """Return the weight of each moment in each row, (J, rows); a row's weights sum to one.

    Row r is exposed around readout (r / (rows - 1) - 1/2), for the exposure time; the image is
    assumed to change linearly between moments.

    Args:
        moments_s: evenly spaced, relative to the middle of the exposure, (J,), s.
        rows: of the image.
        imaging: of its camera.
    """
    if len(moments_s) == 1:
        return np.ones((1, rows))
    middle = imaging.readout_s * (np.arange(rows) / max(rows - 1, 1) - 0.5)
    step = moments_s[1] - moments_s[0]
    at = (middle[None] - moments_s[:, None]) / step
    if not imaging.exposure_s:
        hats: FloatArray = np.maximum(1.0 - np.abs(at), 0.0)
        return hats
    half = imaging.exposure_s / 2 / step
    weights: FloatArray = (_hat_integral(at + half) - _hat_integral(at - half)) / (2 * half)
    return weights


def _hat_integral(x: FloatArray) -> FloatArray:
    """Return the integral of max(1 - |t|, 0) from -1 to x."""
    t = np.clip(x, -1.0, 1.0)
    integral: FloatArray = np.where(t < 0.0, 0.5 * (1.0 + t) ** 2, 1.0 - 0.5 * (1.0 - t) ** 2)
    return integral
