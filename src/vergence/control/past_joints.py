"""Joint positions of the last moments, for the time of an image that arrives late."""

from typing import NamedTuple

import numpy as np
from numba import njit

from vergence.arrays import FloatArray, IntArray

_MEMORY_S = 2.0  # must exceed the latency of images
_MOST = 512  # positions


class PastJoints(NamedTuple):
    """Positions and their times, the oldest first."""

    times: FloatArray  # (K,) s
    positions: FloatArray  # (K, n)
    filled: IntArray  # (1,) how many of them


def no_joints(joint_count: int) -> PastJoints:
    """Return room for the positions of an arm."""
    return PastJoints(np.empty(_MOST), np.empty((_MOST, joint_count)), np.zeros(1, dtype=np.int64))


@njit(cache=True, error_model="numpy")
def remember(past: PastJoints, time: float, position: FloatArray) -> None:
    """Add the position (n,) at a time, in place, and forget what is too old."""
    times, count = past.times, past.filled[0]
    first = 0
    while first < count and times[first] < time - _MEMORY_S:
        first += 1
    if first == 0 and count == len(times):
        first = 1
    count -= first
    for k in range(count if first else 0):
        times[k] = times[k + first]
        past.positions[k] = past.positions[k + first]
    times[count], past.positions[count] = time, position
    past.filled[0] = count + 1


@njit(cache=True, error_model="numpy")
def past_position(past: PastJoints, time: float) -> FloatArray:
    """Return joint positions at a time, (n,), interpolated between those that are known."""
    later = past.filled[0] - 1
    for k in range(past.filled[0] - 1, -1, -1):
        if past.times[k] <= time:
            span = past.times[later] - past.times[k]
            share = min((time - past.times[k]) / span, 1.0) if span > 0.0 else 0.0
            before, after = past.positions[k], past.positions[later]
            position: FloatArray = before + share * (after - before)
            return position
        later = k
    oldest: FloatArray = past.positions[later].copy()
    return oldest
