"""When images are taken, counted in ticks of the faster loop."""

import numpy as np
from numba import njit

from vergence.arrays import FloatArray


@njit(cache=True)
def image_tick(image: int, inner_rate_hz: float, rate_hz: float) -> int:
    """Return the inner tick of an image, ⌊k · inner/rate⌋, exact also where 26 Hz meets 500 Hz."""
    return int(image * inner_rate_hz / rate_hz + 1e-9)


@njit(cache=True)
def image_times(count: int, inner_rate_hz: float, rate_hz: float) -> FloatArray:
    """Return when the first images are taken, (count,), s."""
    times = np.empty(count)
    for k in range(count):
        times[k] = image_tick(k, inner_rate_hz, rate_hz) / inner_rate_hz
    return times
