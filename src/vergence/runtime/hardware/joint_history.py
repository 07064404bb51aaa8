"""Recent joint positions of an arm."""

from collections import deque

import numpy as np

from vergence.arrays import FloatArray
from vergence.signals import JointState

_AHEAD_S = 0.1  # the longest extrapolation by a velocity


class JointHistory:
    """Stores an arm's joint states, to look up the positions at the exposure of an image.

    Args:
        length: number of states to keep; the oldest are dropped.
    """

    def __init__(self, length: int = 1000) -> None:
        self._states: deque[JointState] = deque(maxlen=length)

    def add(self, state: JointState) -> None:
        """Add a state; times must not go backwards."""
        self._states.append(state)

    def at(self, time: float) -> FloatArray:
        """Return the positions (n,) at a time, interpolated linearly between two states.

        Before the first and after the last state they are extrapolated by its velocity, by 0.1 s at
        most.
        """
        assert self._states, "a state is added before one is asked for"
        later = None
        for state in reversed(self._states):
            if state.time <= time:
                return _beyond(state, time) if later is None else _between(state, later, time)
            later = state
        return _beyond(self._states[0], time)


def _between(before: JointState, after: JointState, time: float) -> FloatArray:
    share = (time - before.time) / (after.time - before.time)
    positions: FloatArray = np.asarray(before.position + share * (after.position - before.position))
    return positions


def _beyond(state: JointState, time: float) -> FloatArray:
    ahead_s = min(max(time - state.time, -_AHEAD_S), _AHEAD_S)
    positions: FloatArray = np.asarray(state.position + ahead_s * state.velocity)
    return positions
