"""Wall-clock ticks, for hardware without a clock of its own."""

from time import monotonic, sleep


class Metronome:
    """Wakes its caller at a steady rate.

    If a tick is late by more than a period, the next one follows a full period later instead of
    catching up, so that an arm never receives set-points in a burst.

    Args:
        rate_hz: ticks per second.
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
