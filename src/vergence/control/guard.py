"""The last word before the joints: no set-point passes a position, rate or acceleration limit."""

from typing import NamedTuple

import numpy as np
from numba import njit

from vergence.arrays import BoolArray, FloatArray
from vergence.robot import Arm, Setpoint


class GuardedStep(NamedTuple):
    """The next set-point, and which joints met what."""

    position: FloatArray  # (n,) rad or m
    velocity: FloatArray  # (n,) rad/s or m/s
    at_limit: BoolArray  # (n,) held back from a position limit it was driven against


@njit(cache=True, error_model="numpy")
def guarded_step(
    position: FloatArray,
    velocity: FloatArray,
    wanted: FloatArray,
    limits: FloatArray,
    dt: float,
) -> GuardedStep:
    """Follow wanted rates as far as limits and braking distance allow.

    A set-point moving at v towards a limit, braked by a dt every step from the next one on, travels
    at most v²/(2a) + v dt/2 + a dt²/8. So v ≤ √((a dt/2)² + 2 a (room - a dt²/8)) - a dt/2 can
    always still be stopped, and the state after the step satisfies the same bound again.

    Args:
        position: of the last set-point, (n,).
        velocity: of the last set-point, (n,).
        wanted: the rates asked for, (n,).
        limits: rows q_min, q_max, rate_max, acceleration_max, (4, n).
        dt: inner period, s.
    """
    n = len(position)
    new_position, new_velocity = np.empty(n), np.empty(n)
    at_limit = np.zeros(n, dtype=np.bool_)
    for i in range(n):
        a = limits[3, i]
        want = wanted[i] if np.isfinite(wanted[i]) else 0.0
        v = min(max(want, -limits[2, i]), limits[2, i])
        v = min(max(v, velocity[i] - a * dt), velocity[i] + a * dt)
        fastest_up = stoppable_speed(limits[1, i] - position[i], a, dt)
        fastest_down = stoppable_speed(position[i] - limits[0, i], a, dt)
        at_limit[i] = (v > fastest_up and fastest_up < a * dt) or (
            -v > fastest_down and fastest_down < a * dt
        )
        v = min(max(v, -fastest_down), fastest_up)
        new_velocity[i] = v
        new_position[i] = min(max(position[i] + v * dt, limits[0, i]), limits[1, i])
    return GuardedStep(new_position, new_velocity, at_limit)


@njit(cache=True, error_model="numpy")
def stoppable_speed(room: float, a: float, dt: float) -> float:
    """Return the largest speed that braking with a stops within the room, in steps of dt."""
    if np.isinf(room):
        return np.inf
    usable = max(room - a * dt * dt / 8.0, 0.0)
    speed: float = max(np.sqrt((0.5 * a * dt) ** 2 + 2.0 * a * usable) - 0.5 * a * dt, 0.0)
    return speed


class Guard:
    """Set-points of one arm, stepped at the inner rate and kept inside all its limits.

    Args:
        arm: the arm with its limits.
        start: joint positions at the start, (n,).
        dt: inner period, s.
    """

    def __init__(self, arm: Arm, start: FloatArray, dt: float) -> None:
        self._limits = np.vstack((arm.q_min, arm.q_max, arm.rate_max, arm.acceleration_max))
        self._dt = dt
        self._position = np.clip(start, arm.q_min, arm.q_max)
        self._velocity = np.zeros(arm.joint_count)
        self.joint_count = arm.joint_count
        self.at_limit: BoolArray = np.zeros(arm.joint_count, dtype=np.bool_)

    @property
    def position(self) -> FloatArray:
        """The last set-point (n,), rad or m."""
        return self._position

    @property
    def moving(self) -> bool:
        """Whether the set-point still moves."""
        return bool(np.any(np.abs(self._velocity) > 1e-9))

    def step(self, wanted: FloatArray) -> Setpoint:
        """Return the next set-point on the way to the wanted rates (n,)."""
        self._position, self._velocity, self.at_limit = guarded_step(
            self._position, self._velocity, wanted, self._limits, self._dt
        )
        return Setpoint(self._position, self._velocity)
