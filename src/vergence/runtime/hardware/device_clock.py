"""Converts a device's time stamps to this computer's clock."""

from collections import deque

_DRIFT = 2e-3  # s per second, the largest drift between two clocks
_KNOWN_S = 2.0  # of stamps, after which an estimated drift is used
_RESTART_S = 2.0  # a stamp this far from its expected value restarts the clock


class DeviceClock:
    """Maps the stamps of a device to the time at which they were made, by offset and drift.

    A message arrives after its stamp was made, with a varying delay that is never negative. Of all
    lines ``host = offset + rate * stamp`` that lie below every arrival, the one with the least mean
    delay is used [Moon1999]: the edge of the arrivals' lower convex hull in the middle of the
    window. Stalls and bursts of messages therefore do not affect it. The smallest delay remains in
    the result, since it cannot be distinguished from an offset.

    Args:
        window_s: length of the window to which offset and drift are fitted.
    """

    def __init__(self, window_s: float = 30.0) -> None:
        self._window_s = window_s
        self._hull: deque[tuple[float, float]] = deque()  # (stamp, arrival), lower hull
        self._stamp = self._time = float("-inf")  # the last stamp and its mapped time

    def time(self, stamp: float, arrival: float) -> float:
        """Return when a stamp was made, s, never after its arrival and never before the last one.

        Args:
            stamp: the device's, s; one that goes backwards restarts the clock.
            arrival: when it arrived, s.
        """
        if stamp <= self._stamp or (self._hull and abs(self._ahead(stamp, arrival)) > _RESTART_S):
            self._hull.clear()
        self._stamp = stamp
        self._add(stamp, arrival)
        offset, rate = self._line()
        self._time = min(max(offset + rate * stamp, self._time), arrival)
        return self._time

    def _ahead(self, stamp: float, arrival: float) -> float:
        """Return how much later an arrival is than predicted."""
        last_stamp, last_arrival = self._hull[-1]
        return (arrival - last_arrival) - (stamp - last_stamp)

    def _add(self, stamp: float, arrival: float) -> None:
        hull = self._hull
        while hull and hull[0][0] < stamp - self._window_s:
            hull.popleft()
        while len(hull) > 1 and not _turns_left(hull[-2], hull[-1], (stamp, arrival)):
            hull.pop()
        hull.append((stamp, arrival))

    def _line(self) -> tuple[float, float]:
        """Return offset (s) and rate of the line below all arrivals."""
        first, last = self._hull[0][0], self._hull[-1][0]
        rate = 1.0
        if last - first >= _KNOWN_S:
            before, after = self._edge(0.5 * (first + last))
            rate = (after[1] - before[1]) / (after[0] - before[0])
            rate = min(max(rate, 1.0 - _DRIFT), 1.0 + _DRIFT)
        return min(arrival - rate * stamp for stamp, arrival in self._hull), rate

    def _edge(self, middle: float) -> tuple[tuple[float, float], tuple[float, float]]:
        points = list(self._hull)
        at = next(i for i, (stamp, _) in enumerate(points) if stamp >= middle)
        return points[at - 1], points[at]


def _turns_left(a: tuple[float, float], b: tuple[float, float], c: tuple[float, float]) -> bool:
    """Return whether the path from a over b to c turns left, so that b is on the lower hull."""
    return (b[0] - a[0]) * (c[1] - a[1]) > (b[1] - a[1]) * (c[0] - a[0])
