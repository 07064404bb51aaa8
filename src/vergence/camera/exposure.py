"""When pictures are taken, counted in ticks of the faster loop."""

from numba import njit


@njit(cache=True)
def picture_tick(picture: int, inner_rate_hz: float, rate_hz: float) -> int:
    """Return the inner tick of a picture, ⌊k · inner/rate⌋, exact also where 26 Hz meets 500 Hz."""
    return int(picture * inner_rate_hz / rate_hz + 1e-9)
