"""The target's motion, with the mouse's on top of it."""

import numpy as np

from vergence.arrays import FloatArray
from vergence.geometry import moved_pose
from vergence.simulation import TargetPose

_TIME_CONSTANT_S = 0.08  # of the target behind the mouse
_FASTEST_M_S = 0.3  # a hand with a mouse outruns any tracker
_FASTEST_RAD_S = 1.0


class MovedTarget:
    """A target that moves by itself until the mouse takes it, and stays where it is let go.

    Its own motion pauses while it is dragged, and may continue from there.

    Args:
        own: the motion that the cell describes.

    Attributes:
        held: whether its own motion is paused.
        shift_m: how far the mouse wants it beside its own place, (3,), in the world.
        turn_rad: by how much the mouse wants it turned, (3,), a rotation vector in the world.
    """

    def __init__(self, own: TargetPose) -> None:
        self._own = own
        self._time = self._own_time = 0.0
        self._shift_now, self._turn_now = np.zeros(3), np.zeros(3)
        self.shift_m: FloatArray = np.zeros(3)
        self.turn_rad: FloatArray = np.zeros(3)
        self.held = False

    def pose(self, time: float) -> FloatArray:
        """Return T_world_target (4, 4); to be called with times that do not decrease."""
        dt, self._time = time - self._time, time
        if not self.held:
            self._own_time += dt
        self._shift_now += _step(self.shift_m - self._shift_now, dt, _FASTEST_M_S)
        self._turn_now += _step(self.turn_rad - self._turn_now, dt, _FASTEST_RAD_S)
        step = np.concatenate((self._shift_now, self._turn_now))
        T: FloatArray = moved_pose(self._own(self._own_time), step)
        return T


def _step(gap: FloatArray, dt: float, fastest: float) -> FloatArray:
    """Return what is done of a gap (3,) in a time, at most at a rate."""
    step = gap * min(dt / _TIME_CONSTANT_S, 1.0)
    length, longest = float(np.linalg.norm(step)), fastest * dt
    return step if length <= longest else step * (longest / length)
