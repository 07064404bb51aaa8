"""What a driver delivers while its arm is moved, or not."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from time import monotonic
from typing import NamedTuple

import numpy as np

from vergence.arrays import FloatArray
from vergence.control import Guard
from vergence.robot import Arm
from vergence.runtime.driver import Driver
from vergence.signals import Frame

_SLOW = 0.1  # of the arm's rates and accelerations: how a robot is moved that nobody knows yet


class Watched(NamedTuple):
    """Samples of a while."""

    time: FloatArray  # (K,) s, of the driver's clock
    wall: FloatArray  # (K,) s, of this computer's
    position: FloatArray  # (K, n) measured
    velocity: FloatArray  # (K, n) measured
    frames: tuple[tuple[float, Frame], ...]  # each with the driver's time when it arrived


def watch(driver: Driver, arm: str, seconds: float, hold: Callable[[], None]) -> Watched:
    """Read samples for a while.

    Args:
        driver: to read.
        arm: name of the arm.
        seconds: for how long, of the driver's clock.
        hold: steps the driver.
    """
    rows = []
    frames: list[tuple[float, Frame]] = []
    sample = driver.read()
    end = sample.time + seconds
    while sample.time < end:
        state = sample.joints[arm]
        rows.append((sample.time, monotonic(), state.position, state.velocity))
        frames.extend((sample.time, frame) for frame in sample.frames)
        hold()
        sample = driver.read()
    time, wall, position, velocity = (np.array(column) for column in zip(*rows, strict=True))
    return Watched(time, wall, position, velocity, tuple(frames))


class SlowMotion:
    """Moves one joint after another at a tenth of the arm's limits.

    Args:
        driver: of the arm.
        name: of the arm.
    """

    def __init__(self, driver: Driver, name: str) -> None:
        self._driver, self._name = driver, name
        arm = driver.arms[name]
        self._arm = _slowed(arm)
        self._guard = Guard(self._arm, driver.read().joints[name].position, self._dt)

    @property
    def setpoint(self) -> FloatArray:
        """The set-points of the joints, (n,)."""
        return self._guard.position

    @property
    def rate_max(self) -> FloatArray:
        """How fast each joint is moved at most, (n,), rad/s or m/s."""
        return self._arm.rate_max

    def hold(self) -> None:
        """Step with the set-points at rest, or braking to it."""
        self._step(np.zeros(self._arm.joint_count))

    def toward(self, joint: int, position: float) -> None:
        """Step with a joint on its way to a position, rad or m."""
        rates = np.zeros(self._arm.joint_count)
        rates[joint] = (position - self._guard.position[joint]) / self._dt
        self._step(rates)

    def drive(self, joint: int, by: float) -> float:
        """Move a joint by so much and let it come to rest, rad or m.

        Returns:
            The integral of the rate that the robot reported of it.
        """
        goal, travelled = self._guard.position[joint] + by, 0.0
        self._time = self._driver.read().time
        for _ in self._ticks(joint, by):
            rates = np.zeros(self._arm.joint_count)
            left = goal - self._guard.position[joint]
            # Braking from v takes v²/(2a); two thirds of that rate leave room for rounding.
            brake = np.sqrt(max(0.9 * self._arm.acceleration_max[joint] * abs(left), 0.0))
            rates[joint] = np.sign(left) * min(brake, self._arm.rate_max[joint])
            self._step(rates)
            travelled += self._travelled(joint)
        for _ in range(round(0.3 / self._dt)):
            self.hold()
            travelled += self._travelled(joint)
        return travelled

    def _travelled(self, joint: int) -> float:
        """Return how far a joint has moved since the last sample, by its reported rate."""
        sample = self._driver.read()
        elapsed, self._time = sample.time - self._time, sample.time
        return elapsed * float(sample.joints[self._name].velocity[joint])

    @property
    def _dt(self) -> float:
        return 1.0 / self._driver.inner_rate_hz

    def _ticks(self, joint: int, by: float) -> Iterator[int]:
        """Count the ticks that a move may take."""
        rate, acceleration = self._arm.rate_max[joint], self._arm.acceleration_max[joint]
        seconds = abs(by) / rate + 4.0 * np.sqrt(abs(by) / acceleration) + 0.1
        yield from range(round(seconds / self._dt))

    def _step(self, rates: FloatArray) -> None:
        self._driver.step({self._name: self._guard.step(rates)})


def _slowed(arm: Arm) -> Arm:
    return replace(
        arm,
        rate_max=_SLOW * arm.rate_max,
        acceleration_max=_SLOW * arm.acceleration_max,
    )
