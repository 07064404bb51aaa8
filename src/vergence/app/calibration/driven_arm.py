"""An arm that is driven slowly from pose to pose, on straight lines between its joint positions."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from vergence.arrays import FloatArray
from vergence.control import ClearBraking
from vergence.control.guard import closing_speed
from vergence.errors import DriverSilent
from vergence.robot import Clearance
from vergence.runtime import Driver
from vergence.runtime.following import Follower, FollowingBound
from vergence.runtime.stopping import brake
from vergence.signals import Sample

_SLOW = 0.1  # of the arm's rates and accelerations
_THERE = 1e-4  # rad or m, within which a pose is reached
_HELD_S = 10.0  # for which a robot may be stopped, as by its protective stop
_LONGER_S = 2.0  # that a line may take beside twice its usual time


class DrivenArm:
    """Drives the joints of an arm, within its limits and clear of obstacles.

    Args:
        driver: of the arm.
        name: of the arm.
        clearance: distances between what the arm must not bring together; None for nothing.
        hear: is given every sample.
    """

    def __init__(
        self, driver: Driver, name: str, clearance: Clearance | None, hear: Callable[[Sample], None]
    ) -> None:
        self._driver, self._name, self._hear = driver, name, hear
        self._dt, arm = 1.0 / driver.inner_rate_hz, driver.arms[name]
        rates, accelerations = _SLOW * arm.rate_max, _SLOW * arm.acceleration_max
        self._arm = replace(arm, rate_max=rates, acceleration_max=accelerations)
        start = driver.read().joints[name].position
        braking = None if clearance is None else ClearBraking(self._arm, clearance, self._dt)
        self._follower = Follower(
            self._arm, name, start, self._dt, FollowingBound(), _HELD_S, braking
        )

    @property
    def position(self) -> FloatArray:
        """The set-points of the joints, (n,)."""
        return self._follower.guard.position

    def drive(self, goal: FloatArray) -> None:
        """Move the joints to their goal (n,), rad or m, all at once.

        Raises:
            DriverSilent: if the robot does not answer, is stopped, or does not follow; or if the
                guard has braked the arm before something that it would touch.
        """
        far = np.abs(goal - self.position)
        usual_s = float((far / self._arm.rate_max).max())
        usual_s += float(np.sqrt(far / self._arm.acceleration_max).max())
        ticks = round((2.0 * usual_s + _LONGER_S + _HELD_S) / self._dt)
        for _ in range(ticks):
            if np.abs(goal - self.position).max() < _THERE and not self._follower.guard.moving:
                return
            self.step(self._rates(goal - self.position))
        raise DriverSilent(f"{self._name} does not reach the commanded position")

    def step(self, rates: FloatArray | None = None) -> None:
        """Step at rates (n,), or hold."""
        told = np.zeros(self._arm.joint_count) if rates is None else rates
        self._driver.step({self._name: self._follower.step(told)})
        sample = self._driver.read()
        measured, robot = sample.joints[self._name].position, sample.robots.get(self._name)
        if fault := self._follower.observe(sample.time, measured, robot):
            raise DriverSilent(f"{fault.kind.value}: {fault.reason}")
        if hindrance := self._follower.guard.hindrance:
            raise DriverSilent(f"{self._name} was braked, as {hindrance}")
        self._hear(sample)

    def brake(self) -> None:
        """Bring the arm to rest."""
        brake(self._driver, {self._name: self._follower.guard})

    def _rates(self, gap: FloatArray) -> FloatArray:
        """Return rates (n,) along a gap (n,): the fastest that every joint starts and stops with.

        They are a multiple of the gap, and so is what they change by in a tick: the line stays
        straight.
        """
        far = np.abs(gap)
        moved = far > 1e-9
        if not moved.any():
            return np.zeros_like(gap)
        far, a = far[moved], self._arm.acceleration_max[moved]
        now = self._follower.guard.setpoint.velocity[moved] * np.sign(gap[moved])
        stop = [closing_speed(gap_i, a_i, self._dt) for gap_i, a_i in zip(far, a, strict=True)]
        share = min(
            float((np.array(stop) / far).min()),
            float((self._arm.rate_max[moved] / far).min()),
            float(((np.maximum(now, 0.0) + a * self._dt) / far).min()),
        )
        return share * gap
