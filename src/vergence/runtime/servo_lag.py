"""Predicts the joints to when a command takes effect: servos follow set-points with a lag."""

from collections import deque

from vergence.arrays import FloatArray
from vergence.signals import JointState, Setpoint


class ServoLag:
    """Adds to the measured joints the commanded motion that their servos have not executed yet.

    A servo with lag T follows as q(t + T) = s(t) + b, with a slowly varying offset b, so
    q(t + T) = q(t) + s(t) - s(t - T), whatever b is.

    Args:
        ticks: the lag.
        dt: inner period, s.

    Attributes:
        ticks: the lag.
    """

    def __init__(self, ticks: int, dt: float) -> None:
        self.ticks = ticks
        self._lag_s = ticks * dt
        self._told: deque[FloatArray] = deque(maxlen=ticks + 1)

    def add(self, setpoint: Setpoint) -> None:
        """Store the set-point of this tick."""
        if self._lag_s:
            self._newest = setpoint
            self._told.append(setpoint.position)

    def ahead(self, joints: JointState) -> JointState:
        """Return the joints predicted one lag ahead, from the set-points so far."""
        if not self._told:
            return joints
        position = joints.position + self._told[-1] - self._told[0]
        return JointState(joints.time + self._lag_s, position, self._newest.velocity)
