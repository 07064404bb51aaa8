"""Keeps set-points close to the measured joints."""

from typing import NamedTuple

import numpy as np
from numba import njit

from vergence.arrays import FloatArray
from vergence.control import Braking, Guard
from vergence.robot import Arm
from vergence.runtime.endings import Fault
from vergence.runtime.servo_lag import ServoLag
from vergence.signals import JointState, OutcomeKind, RobotMode, RobotState, Setpoint

_LAG_ROOM = 1.5  # factor by which a servo may lag more than was measured


class FollowingBound(NamedTuple):
    """The largest allowed distance of an arm from all its set-points of the last `lag_s`.

    A critically damped servo of bandwidth ω that is fed the desired rate has an error of at most
    q̈_max/ω², which is added to `offset` for each joint. The defaults are for stiff servos.
    """

    lag_s: float = 0.1  # by which a servo may lag behind its set-points
    offset: float = 0.03  # rad or m, error caused by gravity, other joints or a late tick
    servo_hz: float = np.inf  # the bandwidth of the joints' servos
    servo_lag_s: float = 0.0  # the measured lag of the joints

    def of(self, arm: Arm) -> FloatArray:
        """Return the bound for each joint of an arm (n,), rad or m."""
        bound: FloatArray = self.offset + arm.acceleration_max / (2.0 * np.pi * self.servo_hz) ** 2
        return bound


@njit(cache=True, error_model="numpy")
def farthest_joint(
    measured: FloatArray, setpoint: FloatArray, memory: FloatArray, tick: int
) -> int:
    """Return the joint farthest beyond its bound from all recent set-points, -1 if none is.

    Args:
        measured: joint positions, (n,).
        setpoint: the last one, (n,).
        memory: the bound of each joint, rad or m, followed by the last set-points, (1 + K, n); the
            oldest one is overwritten.
        tick: number of earlier set-points.
    """
    recent = memory[1:]
    oldest = recent[tick % len(recent)]
    for i in range(len(setpoint)):  # a slice assigned would compile its error message as well
        oldest[i] = setpoint[i]
    worst, joint = 0.0, -1
    for i in range(len(measured)):
        if abs(measured[i] - setpoint[i]) <= memory[0, i]:
            continue
        low = high = recent[0, i]
        for k in range(1, len(recent)):
            low, high = min(low, recent[k, i]), max(high, recent[k, i])
        beyond = max(low - measured[i], measured[i] - high) - memory[0, i]
        if beyond > worst:
            worst, joint = beyond, i
    return joint


class Follower:
    """The guarded set-points of one arm, held at the measured joints when the arm does not follow.

    While the arm is stopped, guided by hand, or farther from its recent set-points than the bound,
    the set-points move to the measured joints within all limits. The run resumes from there once
    the arm is free; it ends if the arm is held for longer than `timeout_s`.

    Args:
        arm: with its limits.
        name: of the arm.
        start: measured joints at the start, (n,).
        dt: inner period, s.
        bound: largest allowed distance of the arm from its set-points.
        timeout_s: longest time for which the arm is held.
        braking: finds what the arm would collide with, see `Guard`.
    """

    def __init__(
        self,
        arm: Arm,
        name: str,
        start: FloatArray,
        dt: float,
        bound: FollowingBound,
        timeout_s: float,
        braking: Braking | None = None,
    ) -> None:
        self.guard = Guard(arm, start, dt, braking)
        self.guard.approach(start)  # compiles or loads the code for a hold; nothing moves
        self.holding: Fault | None = None  # reason for which the arm is held at present,
        self._held_for: Fault | None = None  # and for which it was held last
        self._name, self._names = name, arm.names
        self._bound, self._timeout_s = bound.of(arm), timeout_s
        self._lag = ServoLag(round(bound.servo_lag_s / dt), dt)
        lag_s = max(bound.lag_s, _LAG_ROOM * bound.servo_lag_s)
        recent = np.tile(start, (max(round(lag_s / dt), 1), 1))
        self._memory = np.vstack((self._bound, recent))
        self._tick = 0
        self._scale = 1.0
        self._anchor = start  # where set-points go while the arm is held
        self._since, self._freed = 0.0, -np.inf  # s, start of the present hold, end of the last one
        self._held_at = np.full(arm.joint_count, np.inf)

    def observe(self, time: float, measured: FloatArray, robot: RobotState | None) -> Fault | None:
        """Process a sample; return the fault that ends the run if the arm was held for too long."""
        joint = farthest_joint(measured, self.guard.position, self._memory, self._tick)
        self._tick += 1
        if robot is None:
            if joint < 0 and self.holding is None:
                return None
            return self._hold(time, measured, self._reason(joint, measured, None))
        self._scale = robot.speed_scale
        if joint < 0 and self.holding is None and robot.running and robot.speed_scale > 0.0:
            return None
        return self._hold(time, measured, self._reason(joint, measured, robot))

    def step(self, rates: FloatArray) -> Setpoint:
        """Return the next set-point, at desired rates (n,) or towards the measured joints."""
        if self.holding is not None:
            setpoint = self.guard.approach(self._anchor)
        else:
            setpoint = self.guard.step(rates if self._scale == 1.0 else self._scale * rates)
        self._lag.add(setpoint)
        return setpoint

    def steps(self, rates: FloatArray, count: int) -> Setpoint | None:
        """Return the set-point after several steps at desired rates (n,), see `Guard.steps`.

        Only for an arm that follows set-points exactly; None if it lags or is held.
        """
        if self.holding is not None or self._scale != 1.0 or self._lag.ticks:
            return None
        return self.guard.steps(rates, count)

    def ahead(self, joints: JointState) -> JointState:
        """Return the joints predicted to when a command takes effect, one servo lag later."""
        return self._lag.ahead(joints)

    def hindered(self, time: float, measured: FloatArray) -> Fault | None:
        """Return why the arm is held, or why it has hardly moved since it was."""
        unmoved = (np.abs(measured - self._held_at) <= self._bound).all()
        lately = unmoved and time - self._freed < self._timeout_s
        return self.holding or (self._held_for if lately else None)

    def _reason(self, joint: int, measured: FloatArray, robot: RobotState | None) -> Fault | None:
        if robot is not None and not robot.running:
            reason = f"{self._name} reports: {robot.mode.value}"
            return Fault(OutcomeKind.PROTECTIVE_STOP, reason)
        if robot is not None and robot.speed_scale == 0.0:
            reason = f"the speed of {self._name} is set to zero on the robot"
            return Fault(OutcomeKind.PROTECTIVE_STOP, reason)
        if joint < 0:
            return None
        gap = abs(float(measured[joint] - self.guard.position[joint]))
        reason = f"{self._names[joint]} of {self._name} is {gap:.3g} from its set-point"
        return Fault(OutcomeKind.NOT_FOLLOWING, reason)

    def _hold(self, time: float, measured: FloatArray, reason: Fault | None) -> Fault | None:
        """Begin, continue or end a hold; return the fault that ends the run, if any."""
        if reason is not None:
            moved = (np.abs(measured - self._held_at) > self._bound).any()
            if self.holding is None and (moved or time - self._freed > self._timeout_s):
                self._since, self._held_at = time, measured
            # An arm that does not follow is held where it was found: its sensors may be biased, so
            # chasing them could move it. An arm that is stopped or guided by hand is followed.
            if self.holding is None or reason.kind is OutcomeKind.PROTECTIVE_STOP:
                self._anchor = measured
            self.holding = self._held_for = reason
        elif self._anchored(measured):
            self.holding, self._freed = None, time
            return None
        emergency = reason is not None and RobotMode.EMERGENCY_STOP.value in reason.reason
        return self.holding if emergency or time - self._since > self._timeout_s else None

    def _anchored(self, measured: FloatArray) -> bool:
        near = (np.abs(self.guard.position - measured) < 0.5 * self._bound).all()
        return bool(near) and not self.guard.moving
