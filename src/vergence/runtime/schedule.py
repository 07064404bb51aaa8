"""When the loop turns, and how an ageing command fades."""

from numba import njit

from vergence.camera import image_tick


@njit(cache=True)
def command_share(age_s: float, period_s: float, decay_s: float) -> float:
    """Return the fraction of the commanded rates that remains at a given age of their image.

    1 until the next image is due, then decreasing to 0 over `decay_s`.

    Args:
        age_s: since the image arrived.
        period_s: between images.
        decay_s: time from when the next image is due until the rates are zero.
    """
    left: float = (period_s + decay_s - age_s) / decay_s
    return min(max(left, 0.0), 1.0)


class Schedule:
    """Counts inner ticks; the loop turns on every image, and once per period if none arrives.

    Args:
        inner_rate_hz: rate of the ticks.
        outer_rate_hz: rate of the images.
    """

    def __init__(self, inner_rate_hz: float, outer_rate_hz: float) -> None:
        self._rates_hz = inner_rate_hz, outer_rate_hz
        self._periods = 0
        self._due = 0  # tick at which the next period begins
        self._last_due = self._last_image = -1
        self.period_over = False  # whether a period of the camera ends with this tick

    def ticks_left(self, tick: int) -> int:
        """Return the number of ticks until the next period begins."""
        return self._due - tick

    def turns(self, tick: int, images: bool) -> bool:
        """Return whether the loop turns at a tick, given whether it brings images."""
        overdue = self._last_image <= self._last_due
        self.period_over = tick >= self._due
        if self.period_over:
            self._last_due = tick
            self._periods += 1
            self._due = image_tick(self._periods, *self._rates_hz)
        if images:
            self._last_image = tick
        return images or (self.period_over and overdue)
