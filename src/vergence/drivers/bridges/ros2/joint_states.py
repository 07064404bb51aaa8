"""Joint states as they come, in the order of the arm."""

import math
from itertools import pairwise
from statistics import median
from typing import Any

from ..joints import Joints

_ENOUGH_S, _ENOUGH = 0.5, 20  # from which the rate is known


class JointStates:
    """Reads an arm's joints off messages that may hold others too, or lack some.

    Args:
        names: of the arm's joints.
    """

    def __init__(self, names: list[str]) -> None:
        self._names, self._order = names, list[int]()
        self._seen: tuple[str, ...] = ()  # the names of the last message
        self.others: set[str] = set()  # all names that came
        self._first_ns = self._last_ns = 0
        self._last: Joints | None = None
        self._times: list[float] = []
        self.backwards_s = 0.0  # by which the stamps went back

    @property
    def first_ns(self) -> int | None:
        """The stamp from which time counts; None before there is one."""
        return self._first_ns if self._last is not None else None

    def read(self, message: Any) -> Joints | None:
        """Return the arm's joints; None if the message is not of all of them, or not newer."""
        if (names := tuple(message.name)) != self._seen:
            self._seen = names
            self.others |= set(names)
            known = set(self._names) <= set(names)
            self._order = [names.index(name) for name in self._names] if known else []
        stamp = message.header.stamp.sec * 10**9 + message.header.stamp.nanosec
        if not self._order or (self._last is not None and stamp == self._last_ns):
            return None
        if self._last is None:
            self._first_ns = stamp
        elif stamp < self._last_ns:
            self.backwards_s = 1e-9 * (self._last_ns - stamp)
            return None
        time = 1e-9 * (stamp - self._first_ns)
        position = [message.position[i] for i in self._order]
        self._last_ns, self._last = stamp, Joints(time, position, self._rates(message, time))
        if len(self._times) < 1000:
            self._times.append(time)
        return self._last

    def rate_hz(self) -> float | None:
        """Return how many come in a second; None while too few have come."""
        times = list(self._times)
        if len(times) < _ENOUGH or times[-1] - times[0] < _ENOUGH_S:
            return None
        return 1.0 / median(b - a for a, b in pairwise(times))

    def _rates(self, message: Any, time: float) -> list[float]:
        """Return the joints' rates (n,), from their positions where the message has none."""
        if len(message.velocity) == len(message.name):
            told = [message.velocity[i] for i in self._order]
            if all(map(math.isfinite, told)):
                return told
        if self._last is None:
            return [0.0] * len(self._order)
        dt = time - self._last.time
        before = self._last.position
        return [(message.position[i] - q) / dt for i, q in zip(self._order, before, strict=True)]
