"""Where joints will be when a command is felt: their servos follow set-points late."""

from collections import deque

from vergence.arrays import FloatArray
from vergence.signals import JointState, Setpoint


class ServoLag:
    """Adds to measured joints the commanded motion that their servos have not yet executed.

    A servo with lag T follows as q(t + T) = s(t) + b, with an offset b that changes slowly. So
    q(t + T) = q(t) + s(t) - s(t - T), whatever b is.

    Args:
        ticks: of lag.
        dt: inner period, s.

    Attributes:
        ticks: of lag.
    """

    def __init__(self, ticks: int, dt: float) -> None:
        self.ticks = ticks
        self._lag_s = ticks * dt
        self._told: deque[FloatArray] = deque(maxlen=ticks + 1)

    def add(self, setpoint: Setpoint) -> None:
        """Take note of the set-point of this tick."""
        if self._lag_s:
            self._newest = setpoint
            self._told.append(setpoint.position)

    def ahead(self, joints: JointState) -> JointState:
        """Return the joints as they will be one lag from now, by the set-points so far."""
        if not self._told:
            return joints
        position = joints.position + self._told[-1] - self._told[0]
        return JointState(joints.time + self._lag_s, position, self._newest.velocity)
