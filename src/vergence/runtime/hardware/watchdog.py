"""Runs on the robot's side: follows set-points, and stops when they no longer arrive."""

import numpy as np

from vergence.arrays import FloatArray
from vergence.control import Guard, closing_rates
from vergence.robot import Arm
from vergence.signals import Setpoint


class Watchdog:
    """Sits between a link that may fail and an arm's servo, and is stepped by the servo's clock.

    Between two set-points the arm continues at the speed of the last one, so a late message has no
    effect. After `timeout_s` without one the arm is braked to rest and stays there; moving it again
    takes a new watchdog. No set-point exceeds a limit of the arm. There is no timeout before the
    first set-point.

    Args:
        arm: the arm with its limits.
        start: joint positions now, (n,), rad or m.
        dt: period of the servo, s.
        timeout_s: longest time for which the arm may continue without a set-point.
    """

    def __init__(self, arm: Arm, start: FloatArray, dt: float, timeout_s: float = 0.1) -> None:
        self._guard = Guard(arm, start, dt)
        self._limits = arm.limits
        self._dt, self._timeout_s = dt, timeout_s
        self._desired: Setpoint | None = None
        self._silent_s = 0.0
        self.tripped = False  # whether the timeout has passed

    @property
    def at_rest(self) -> bool:
        """Whether the arm has been brought to a stop."""
        return not self._guard.moving

    def hear(self, setpoint: Setpoint, age_s: float = 0.0) -> None:
        """Process a set-point; one that is not finite or not of the arm's length is ignored.

        Args:
            setpoint: desired position and rate of the arm.
            age_s: time since it was due; beyond the timeout it is ignored as well.
        """
        position, velocity = (
            np.asarray(part, dtype=np.float64) for part in (setpoint.position, setpoint.velocity)
        )
        if position.shape != self._limits[0].shape or velocity.shape != position.shape:
            return
        if not age_s <= self._timeout_s or not np.isfinite(position + velocity).all():
            return
        self._desired = Setpoint(position + age_s * velocity, velocity)
        self._silent_s = 0.0

    def step(self) -> Setpoint:
        """Return the set-point for the servo at this tick."""
        if self._desired is None:
            return self._guard.step(np.zeros(self._guard.joint_count))
        self.tripped |= self._silent_s > self._timeout_s
        self._silent_s += self._dt
        if self.tripped:
            return self._guard.step(np.zeros(self._guard.joint_count))
        out = self._guard.step(self._rates(self._desired))
        ahead = self._desired.position + self._dt * self._desired.velocity
        self._desired = Setpoint(ahead, self._desired.velocity)
        return out

    def _rates(self, desired: Setpoint) -> FloatArray:
        """Return rates that keep the arm on the set-point, or bring it there with safe braking."""
        gap = desired.position - self._dt * desired.velocity - self._guard.position
        return desired.velocity + closing_rates(gap, self._limits, self._dt)
