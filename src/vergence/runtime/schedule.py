"""When the loop looks, and how much of an ageing command is left."""

from numba import njit

from vergence.camera import image_tick


@njit(cache=True)
def command_share(age_s: float, period_s: float, decay_s: float) -> float:
    """Return the share of the commanded rates that is left at an age of their image.

    All of it until the next image is due, then ever less, and nothing after `decay_s`.

    Args:
        age_s: since the image arrived.
        period_s: between images.
        decay_s: from when the next image is due until nothing is left.
    """
    left: float = (period_s + decay_s - age_s) / decay_s
    return min(max(left, 0.0), 1.0)


class Schedule:
    """Counts inner ticks; the loop turns on every image, and once a period where none arrives.

    Args:
        inner_rate_hz: of the ticks.
        outer_rate_hz: of the images.
    """

    def __init__(self, inner_rate_hz: float, outer_rate_hz: float) -> None:
        self._rates_hz = inner_rate_hz, outer_rate_hz
        self._periods = 0
        self._due = 0  # tick at which the next period begins
        self._last_due = self._last_image = -1
        self.period_over = False  # whether a period of the camera ends with this tick

    def ticks_left(self, tick: int) -> int:
        """Return how many ticks it is until the next period begins."""
        return self._due - tick

    def turns(self, tick: int, images: bool) -> bool:
        """Return whether the loop turns at a tick, which may bring images."""
        overdue = self._last_image <= self._last_due
        self.period_over = tick >= self._due
        if self.period_over:
            self._last_due = tick
            self._periods += 1
            self._due = image_tick(self._periods, *self._rates_hz)
        if images:
            self._last_image = tick
        return images or (self.period_over and overdue)
