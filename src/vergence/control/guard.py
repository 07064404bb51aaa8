"""Final safety stage: set-points that keep every position, rate and acceleration limit."""

from typing import NamedTuple, Protocol

import numpy as np
from numba import njit
from numpy.typing import ArrayLike

from vergence.arrays import BoolArray, FloatArray, as_floats
from vergence.errors import InputError, ShapeError
from vergence.robot import Arm
from vergence.signals import Setpoint

_SPARE = 1e-9  # rad or m beyond the braking distance; closer to a limit, rounding decides


class GuardedStep(NamedTuple):
    """The next set-point, and which joints are at a limit."""

    position: FloatArray  # (n,) rad or m
    velocity: FloatArray  # (n,) rad/s or m/s
    at_limit: BoolArray  # (n,) held back from a position limit that they were driven towards


@njit(cache=True, error_model="numpy")
def guarded_step(
    position: FloatArray,
    velocity: FloatArray,
    commanded: FloatArray,
    limits: FloatArray,
    dt: float,
) -> GuardedStep:
    """Follow desired rates as far as limits and braking distance allow.

    A set-point moving at v towards a limit, braked by a dt every step from the next one on, travels
    at most v²/(2a) + v dt/2 + a dt²/8. So any v ≤ √((a dt/2)² + 2 a (room - a dt²/8)) - a dt/2 can
    still be stopped, and the state after the step satisfies the same bound again.

    Args:
        position: of the last set-point, (n,).
        velocity: of the last set-point, (n,).
        commanded: desired rates, (n,).
        limits: rows q_min, q_max, rate_max, acceleration_max, (4, n).
        dt: inner period, s.
    """
    n = len(position)
    new_position, new_velocity = np.empty(n), np.empty(n)
    at_limit = np.zeros(n, dtype=np.bool_)
    for i in range(n):
        new_position[i], new_velocity[i], at_limit[i] = guarded_joint(
            position[i], velocity[i], commanded[i], limits[:, i], dt
        )
    return GuardedStep(new_position, new_velocity, at_limit)


@njit(cache=True, error_model="numpy")
def guarded_joint(
    position: float, velocity: float, commanded: float, limits: FloatArray, dt: float
) -> tuple[float, float, bool]:
    """Compute `guarded_step` for one joint; limits (4,).

    A joint that started outside its range is returned to it, at a speed from which it can stop
    there.
    """
    a = limits[3]
    v = reachable_rate(commanded, limits[2])
    if position > limits[1]:
        v = min(v, -min(closing_speed(position - limits[1], a, dt), limits[2]))
    elif position < limits[0]:
        v = max(v, min(closing_speed(limits[0] - position, a, dt), limits[2]))
    v = min(max(v, velocity - a * dt), velocity + a * dt)
    fastest_up = stoppable_speed(limits[1] - position, a, dt)
    fastest_down = stoppable_speed(position - limits[0], a, dt)
    at_limit = (v > fastest_up and fastest_up < a * dt) or (
        -v > fastest_down and fastest_down < a * dt
    )
    v = min(max(v, -fastest_down), fastest_up)
    low, high = min(limits[0], position), max(limits[1], position)  # never farther outside
    return min(max(position + v * dt, low), high), v, at_limit


@njit(cache=True, error_model="numpy")
def reachable_rate(commanded: float, rate_max: float) -> float:
    """Return the rate clamped to its limit, 0 if it is NaN."""
    return min(max(commanded, -rate_max), rate_max) if np.isfinite(commanded) else 0.0


@njit(cache=True, error_model="numpy")
def guarded_steps(
    position: FloatArray,
    velocity: FloatArray,
    commanded: FloatArray,
    limits: FloatArray,
    dt: float,
    count: int,
    stuck: BoolArray,
) -> None:
    """Take several guarded steps with the same desired rates, in place, exact to the last bit.

    A joint so far from its limits that it could stop anywhere on the way only ramps to its rate;
    one that might have to brake is stepped in full.

    Args:
        position: set-points, (n,); updated.
        velocity: their rates, (n,); updated.
        commanded: as for `guarded_step`, like the following ones.
        limits: (4, n).
        dt: inner period, s.
        count: number of steps.
        stuck: set to which joints a limit held back at every step, (n,).
    """
    for i in range(len(position)):
        v, most = reachable_rate(commanded[i], limits[2, i]), limits[3, i] * dt
        up, down = max(velocity[i], v, 0.0), max(-velocity[i], -v, 0.0)
        least_room = min(
            _room(limits[1, i] - position[i] - count * dt * up, up, limits[3, i], dt),
            _room(position[i] - limits[0, i] - count * dt * down, down, limits[3, i], dt),
        )
        if least_room > _SPARE:
            for _ in range(count):
                velocity[i] = min(max(v, velocity[i] - most), velocity[i] + most)
                position[i] += velocity[i] * dt
            stuck[i] = False
            continue
        stuck[i] = True
        for _ in range(count):
            position[i], velocity[i], at_limit = guarded_joint(
                position[i], velocity[i], commanded[i], limits[:, i], dt
            )
            stuck[i] &= at_limit


@njit(cache=True, error_model="numpy")
def _room(room: float, speed: float, a: float, dt: float) -> float:
    """Return the room left after braking from a speed with a, by `guarded_step`'s bound."""
    return room - a * dt * dt / 8.0 - speed * (speed + a * dt) / (2.0 * a)


@njit(cache=True, error_model="numpy")
def stoppable_speed(room: float, a: float, dt: float) -> float:
    """Return the largest speed from which braking with a stops within the room, in steps of dt."""
    if np.isinf(room):
        return np.inf
    usable = max(room - a * dt * dt / 8.0, 0.0)
    speed: float = max(np.sqrt((0.5 * a * dt) ** 2 + 2.0 * a * usable) - 0.5 * a * dt, 0.0)
    return speed


@njit(cache=True, error_model="numpy")
def closing_speed(gap: float, a: float, dt: float) -> float:
    """Return the speed at which to close a gap such that braking with a stops at its end."""
    speed: float = min(gap / dt, max(stoppable_speed(gap, a, dt), a * dt / 8.0))
    return speed


@njit(cache=True, error_model="numpy")
def closing_rates(gap: FloatArray, limits: FloatArray, dt: float) -> FloatArray:
    """Return the rates (n,) that close the gaps (n,) as fast as the limits (4, n) allow."""
    rates = np.empty(len(gap))
    for i in range(len(gap)):
        speed = min(closing_speed(abs(gap[i]), limits[3, i], dt), limits[2, i])
        rates[i] = np.copysign(speed, gap[i])
    return rates


class Braking(Protocol):
    """Knows what an arm would touch."""

    def hindrance(self, setpoint: Setpoint) -> str:
        """Return what the arm would touch if it braked from here; else nothing."""
        ...

    def stays_clear(self, q: FloatArray, fastest: FloatArray, seconds: float) -> bool:
        """Return whether, for sure, no set-point is hindered that moves for so long from q (n,).

        Args:
            q: joint positions, (n,).
            fastest: what no rate exceeds, (n,).
            seconds: for which they move.
        """
        ...


class Guard:
    """Set-points of one arm, stepped at the inner rate and kept within all its limits.

    ``guard.step(rates)`` follows any rates as far as the limits allow; call it once per period. A
    joint that starts outside a position limit is returned to it at a limited rate.

    Args:
        arm: the arm with its limits.
        start: joint positions at the start, (n,) rad or m.
        period_s: of the steps.
        braking: finds what the arm would collide with if it braked from a set-point; None for no
            check.

    Attributes:
        hindrance: what it would have touched, from then on only braking; else nothing.

    Raises:
        InputError: if the positions are not finite, or the period is not positive.
        ShapeError: if there is not one position per joint.
    """

    def __init__(
        self, arm: Arm, start: ArrayLike, period_s: float, braking: Braking | None = None
    ) -> None:
        if not 0.0 < period_s < np.inf:
            raise InputError("Guard", "period_s", period_s, "a number of seconds above zero")
        position = as_floats(start, (arm.joint_count,), "start")
        if not np.isfinite(position).all():
            raise InputError("Guard", "start", position, "finite joint positions")
        self._limits = arm.limits
        self._dt = period_s
        self._position: FloatArray = position.copy()
        self._velocity: FloatArray = np.zeros(arm.joint_count)
        self._desired = np.zeros(arm.joint_count)  # writeable and contiguous, as the kernel expects
        self.joint_count = arm.joint_count
        self._braking, self.hindrance = braking, ""
        self.at_limit: BoolArray = np.zeros(arm.joint_count, dtype=np.bool_)

    @property
    def position(self) -> FloatArray:
        """The last set-point (n,), rad or m."""
        return self._position

    @property
    def setpoint(self) -> Setpoint:
        """The last set-point."""
        return Setpoint(self._position, self._velocity)

    @property
    def moving(self) -> bool:
        """Whether the set-point still moves."""
        return bool(np.any(np.abs(self._velocity) > 1e-9))

    def step(self, rates: ArrayLike) -> Setpoint:
        """Return the next set-point on the way to joint rates (n,), rad/s or m/s.

        A rate that is not a finite number means rest.

        Raises:
            ShapeError: if there is not one rate a joint; no set-point is made.
        """
        self._desired[:] = as_floats(rates, (self.joint_count,), "rates")
        position, velocity, at_limit = guarded_step(
            self._position, self._velocity, self._desired, self._limits, self._dt
        )
        if self._braking is not None and not self.hindrance:
            self.hindrance = self._braking.hindrance(Setpoint(position, velocity))
        if self.hindrance:
            return self.brake()
        self._position, self._velocity, self.at_limit = position, velocity, at_limit
        return self.setpoint

    def steps(self, rates: ArrayLike, count: int) -> Setpoint | None:
        """Take many steps on the way to the same joint rates (n,) at once.

        Returns:
            The last set-point; None, and no step is taken, where each must be looked at.
        """
        self._desired[:] = as_floats(rates, (self.joint_count,), "rates")
        if self.hindrance or not self._stays_clear(count):
            return None
        position, velocity = self._position.copy(), self._velocity.copy()
        at_limit = np.empty(self.joint_count, dtype=np.bool_)
        guarded_steps(position, velocity, self._desired, self._limits, self._dt, count, at_limit)
        self._position, self._velocity, self.at_limit = position, velocity, at_limit
        return self.setpoint

    def _stays_clear(self, count: int) -> bool:
        """Return whether the next steps need not be looked at one by one."""
        if self._braking is None:
            return True
        q, (low, high, rate_max, _) = self._position, self._limits
        fastest = np.maximum(np.abs(self._desired), np.abs(self._velocity))
        # A joint outside its range is brought back at a rate of its own.
        fastest = np.where((q < low) | (q > high), rate_max, np.minimum(fastest, rate_max))
        return self._braking.stays_clear(q, fastest, count * self._dt)

    def brake(self) -> Setpoint:
        """Return the next set-point on the way to rest, also where that is outside the range."""
        limits, self._desired[:] = self._limits.copy(), 0.0
        limits[0] = np.minimum(limits[0], self._position)
        limits[1] = np.maximum(limits[1], self._position)
        self._position, self._velocity, self.at_limit = guarded_step(
            self._position, self._velocity, self._desired, limits, self._dt
        )
        return self.setpoint

    def approach(self, position: FloatArray) -> Setpoint:
        """Return the next set-point on the way to a position (n,), where it comes to rest."""
        if np.shape(position) != self._desired.shape:
            raise ShapeError("position", np.shape(position), self._desired.shape)
        return self.step(closing_rates(position - self._position, self._limits, self._dt))
