"""Slows down a sender of too many messages."""

from collections.abc import Callable
from time import monotonic


class RateLimit:
    """Tells how long to wait before the next message is read.

    Args:
        rate_hz: messages a second in the long run.
        burst: messages that may come at once.
        clock: returns the time, s.
    """

    def __init__(self, rate_hz: float, burst: int, clock: Callable[[], float] = monotonic) -> None:
        self._rate_hz, self._burst, self._clock = rate_hz, float(burst), clock
        self._left, self._then = float(burst), clock()

    def take(self) -> float:
        """Count a message; return how long to wait before the next, s."""
        now = self._clock()
        self._left = min(self._burst, self._left + (now - self._then) * self._rate_hz) - 1.0
        self._then = now
        return max(-self._left / self._rate_hz, 0.0)
