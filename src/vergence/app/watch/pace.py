"""The pace of simulated time on the live page."""

from time import perf_counter

_MOST_BEHIND_S = 0.1  # what is later than this is not made up for
_MEASURED_OVER_S = 0.5


class Pace:
    """Keeps simulated time beside the wall clock; pauses, steps and changes speed.

    Attributes:
        paused: whether the run is paused.
        speed: desired simulated seconds a second; the machine may be slower.
        measured: simulated seconds a second, lately.
    """

    def __init__(self) -> None:
        self.paused = False
        self.speed = 1.0
        self.measured = 0.0
        self._steps = 0
        self._anchor: tuple[float, float] | None = None  # one instant, simulated and on the wall, s
        self._mark = (0.0, 0.0)  # likewise, from which the pace is measured

    def pause(self) -> None:
        """Stop time."""
        self.paused = True

    def resume(self) -> None:
        """Let the run continue."""
        self.paused, self._steps, self._anchor = False, 0, None

    def step(self) -> None:
        """Let time pass to the next image, then pause."""
        self.paused = True
        self._steps += 1

    def set_speed(self, speed: float) -> None:
        """Set the speed, in multiples of real time."""
        self.speed, self._anchor = speed, None

    def delay(self, time: float) -> float | None:
        """Return how long to wait, s, before a simulated time may pass; None while paused.

        It is asked until it says 0, and a step counts as done with that.
        """
        now = perf_counter()
        if self.paused:
            self._anchor = None
            if not self._steps:
                return None
            self._steps -= 1
            return 0.0
        if self._anchor is None:
            self._anchor = self._mark = (time, now)
        early = self._anchor[1] + (time - self._anchor[0]) / self.speed - now
        if early > 0.0:
            return early
        if early < -_MOST_BEHIND_S:
            self._anchor = (time, now)
        self._measure(time, now)
        return 0.0

    def _measure(self, time: float, now: float) -> None:
        passed = now - self._mark[1]
        if passed >= _MEASURED_OVER_S:
            self.measured = (time - self._mark[0]) / passed
            self._mark = (time, now)
