"""Where an arm stood a moment ago."""

from collections import deque

import numpy as np

from vergence.arrays import FloatArray
from vergence.signals import JointState

_AHEAD_S = 0.1  # how far beyond the states that are remembered a velocity is believed


class JointHistory:
    """Remembers an arm's joints, to say where they were when an image was exposed.

    Args:
        length: how many states to keep; the oldest go first.
    """

    def __init__(self, length: int = 1000) -> None:
        self._states: deque[JointState] = deque(maxlen=length)

    def add(self, state: JointState) -> None:
        """Remember a state; times must not go backwards."""
        self._states.append(state)

    def at(self, time: float) -> FloatArray:
        """Return the positions (n,) at a time, between two states on the line that joins them.

        Beyond the first and the last state, the joints continue at its velocity, for 0.1 s at most.
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
