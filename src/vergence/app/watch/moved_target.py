"""The target's motion, with the mouse's on top of it."""

import numpy as np

from vergence.arrays import FloatArray
from vergence.simulation import TargetPose

_TIME_CONSTANT_S = 0.08  # of the target behind the mouse
_FASTEST_M_S = 0.3  # a hand with a mouse outruns any tracker


class MovedTarget:
    """A target that moves by itself until the mouse takes it, and stays where it is let go.

    Its own motion stands still while the mouse has it, and may be let go on from there.

    Args:
        own: the motion that the cell describes.

    Attributes:
        held: whether its own motion stands still.
        shift_m: how far the mouse wants it beside its own place, (3,), in the world.
    """

    def __init__(self, own: TargetPose) -> None:
        self._own = own
        self._time = self._own_time = 0.0
        self._shift_now = np.zeros(3)
        self.shift_m: FloatArray = np.zeros(3)
        self.held = False

    def pose(self, time: float) -> FloatArray:
        """Return T_world_target (4, 4); to be called with times that do not decrease."""
        dt, self._time = time - self._time, time
        if not self.held:
            self._own_time += dt
        step = (self.shift_m - self._shift_now) * min(dt / _TIME_CONSTANT_S, 1.0)
        longest = _FASTEST_M_S * dt
        length = float(np.linalg.norm(step))
        self._shift_now += step if length <= longest else step * (longest / length)
        T = self._own(self._own_time).copy()
        T[:3, 3] += self._shift_now
        return T
