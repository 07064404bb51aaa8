"""Differences of angles."""

import numpy as np

from vergence.arrays import FloatArray


def wrapped(difference: FloatArray, period: float = 2.0 * np.pi) -> FloatArray:
    """Return a difference of angles wrapped to within half a period of zero."""
    result: FloatArray = difference - period * np.round(difference / period)
    return result
