"""The driver of a real cell on the live page."""

from collections.abc import Callable

from vergence.runtime import Driver, DriverWrapper
from vergence.signals import Sample


class WatchedRobot(DriverWrapper):
    """Calls a function between two turns of the loop, which must not make the loop wait.

    Args:
        driver: of the robot.
        rate_hz: how often, at most.

    Attributes:
        between: called with the newest sample, once the loop runs.
        time: of the newest sample, s.
    """

    def __init__(self, driver: Driver, rate_hz: float) -> None:
        super().__init__(driver)
        self.between: Callable[[Sample], None] | None = None
        self.time = 0.0
        self._period_s, self._due = 1.0 / rate_hz, 0.0

    def read(self) -> Sample:
        """Return joints and images, after the call between turns."""
        sample = super().read()
        self.time = sample.time
        if self.between is not None and sample.time >= self._due:
            self._due = sample.time + self._period_s
            self.between(sample)
        return sample
