"""A controller's clock as this computer knows it."""

from time import monotonic

_DRIFT = 1e-3  # s a second by which two clocks may run apart


class ControllerClock:
    """Says what a controller's clock shows now, from the times that it reported.

    A report is late by an unknown time, never early, so the least late one counts. Clocks drift,
    hence an old report counts a little less with every second.

    Args:
        time: that the controller reported just now, s.
    """

    def __init__(self, time: float) -> None:
        self._heard = monotonic()
        self._offset = time - self._heard

    def hear(self, time: float) -> None:
        """Take a time that has just arrived, s."""
        arrived = monotonic()
        aged = self._offset - _DRIFT * (arrived - self._heard)
        self._offset, self._heard = max(time - arrived, aged), arrived

    def now(self) -> float:
        """Return the time of the controller's clock, s; any thread may ask."""
        return monotonic() + self._offset
