"""The wall clock, for hardware that has none of its own."""

from time import monotonic, sleep


class Metronome:
    """Wakes its caller at a steady rate.

    A tick that was missed by more than a period is not made up for: the next one comes a period
    after the late one, so that an arm never gets set-points in a rush.

    Args:
        rate_hz: ticks a second.
    """

    def __init__(self, rate_hz: float) -> None:
        self.period_s = 1.0 / rate_hz
        self._next = monotonic() + self.period_s

    @property
    def left_s(self) -> float:
        """Time until the next tick; 0 if it is due."""
        return max(self._next - monotonic(), 0.0)

    def wait(self) -> None:
        """Sleep until the next tick."""
        late = monotonic() - self._next
        if late < 0.0:
            sleep(-late)
        self._next += self.period_s if late < self.period_s else late + self.period_s
