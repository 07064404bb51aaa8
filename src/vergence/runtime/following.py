"""Set-points that stay with the measured joints."""

from typing import NamedTuple

import numpy as np
from numba import njit

from vergence.arrays import FloatArray
from vergence.control import Braking, Guard
from vergence.robot import Arm
from vergence.runtime.endings import Fault
from vergence.runtime.servo_lag import ServoLag
from vergence.signals import JointState, OutcomeKind, RobotMode, RobotState, Setpoint

_LAG_ROOM = 1.5  # how much longer a servo may lag than was measured, and still follow


class FollowingBound(NamedTuple):
    """How far an arm may be from its set-points: so far from all those of the last `lag_s`.

    A critically damped servo of bandwidth ω that is fed the desired rate errs by at most q̈_max/ω²;
    this is added to `offset` for each joint. The defaults are those of stiff servos.
    """

    lag_s: float = 0.1  # by which a servo may lag behind its set-points
    offset: float = 0.03  # rad or m that gravity, other joints and a late tick explain
    servo_hz: float = np.inf  # the bandwidth of the joints' servos
    servo_lag_s: float = 0.0  # by which the joints follow, as it was measured

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
        memory: the bound of each joint, rad or m, then the last set-points, (1 + K, n); the oldest
            is overwritten.
        tick: how many set-points there were before.
    """
    recent = memory[1:]
    recent[tick % len(recent)] = setpoint
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
    """The guarded set-points of one arm, held back to where the arm is when it does not follow.

    While the arm is stopped, guided by hand, or farther from its recent set-points than the bound,
    set-points go to the measured joints within all limits. From there the run resumes as soon as
    the arm is free; a run that waited for longer than `timeout_s` ends.

    Args:
        arm: with its limits.
        name: of the arm.
        start: measured joints at the start, (n,).
        dt: inner period, s.
        bound: how far the arm may be from its set-points.
        timeout_s: how long to wait for it.
        braking: finds what the arm would touch, see `Guard`.
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
        self.guard.approach(start)  # compiles or loads what a hold needs; it moves nothing
        self.holding: Fault | None = None  # why the arm is held, if it is,
        self._held_for: Fault | None = None  # and why it was held last
        self._name, self._names = name, arm.names
        self._bound, self._timeout_s = bound.of(arm), timeout_s
        self._lag = ServoLag(round(bound.servo_lag_s / dt), dt)
        lag_s = max(bound.lag_s, _LAG_ROOM * bound.servo_lag_s)
        recent = np.tile(start, (max(round(lag_s / dt), 1), 1))
        self._memory = np.vstack((self._bound, recent))
        self._tick = 0
        self._scale = 1.0
        self._anchor = start  # where set-points go while the arm is held
        self._since, self._freed = 0.0, -np.inf  # s, when the arm was held first, and freed last
        self._held_at = np.full(arm.joint_count, np.inf)

    def observe(self, time: float, measured: FloatArray, robot: RobotState | None) -> Fault | None:
        """Take note of where the arm is; return why the run ends, if it was held for too long."""
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
        """Return the next set-point, at desired rates (n,) or on the way to the measured joints."""
        if self.holding is not None:
            setpoint = self.guard.approach(self._anchor)
        else:
            setpoint = self.guard.step(rates if self._scale == 1.0 else self._scale * rates)
        self._lag.add(setpoint)
        return setpoint

    def steps(self, rates: FloatArray, count: int) -> Setpoint | None:
        """Return the set-point after many steps at desired rates (n,), by `Guard.steps`.

        It is for an arm that follows set-points exactly: one that lags or is held is None.
        """
        if self.holding is not None or self._scale != 1.0 or self._lag.ticks:
            return None
        return self.guard.steps(rates, count)

    def ahead(self, joints: JointState) -> JointState:
        """Return measured joints as they will be when a command is felt, one servo lag later."""
        return self._lag.ahead(joints)

    def hindered(self, time: float, measured: FloatArray) -> Fault | None:
        """Return why the arm is held, or has hardly moved from where it last was."""
        stands = (np.abs(measured - self._held_at) <= self._bound).all()
        lately = stands and time - self._freed < self._timeout_s
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
        """Begin, continue or end a hold; return why the run ends, if it does."""
        if reason is not None:
            moved = (np.abs(measured - self._held_at) > self._bound).any()
            if self.holding is None and (moved or time - self._freed > self._timeout_s):
                self._since, self._held_at = time, measured
            # An arm that does not follow is met where it was found, not chased: its sensors may
            # be biased. One that is stopped or guided by hand is kept up with.
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
