"""Set-points that stay with the measured joints."""

from typing import NamedTuple

import numpy as np
from numba import njit

from vergence.arrays import FloatArray
from vergence.control import Guard
from vergence.robot import Arm
from vergence.runtime.endings import Fault
from vergence.signals import OutcomeKind, RobotMode, RobotState, Setpoint


class FollowingBound(NamedTuple):
    """How far an arm may be from its set-points: so far from all those of the last `lag_s`."""

    lag_s: float = 0.1  # by which a servo lags behind its set-points
    offset: float = 0.03  # rad or m, for overshoot and what gravity does


@njit(cache=True, error_model="numpy")
def farthest_joint(
    measured: FloatArray, setpoint: FloatArray, recent: FloatArray, row: int, bound: float
) -> int:
    """Return the joint farthest outside of its recent set-points, -1 if none is by the bound.

    Args:
        measured: joint positions, (n,).
        setpoint: the last one, (n,); it is written into a row of `recent`.
        recent: the last set-points, (K, n).
        row: which one is the oldest.
        bound: rad or m.
    """
    recent[row] = setpoint
    worst, joint = bound, -1
    for i in range(len(measured)):
        low = high = recent[0, i]
        for k in range(1, len(recent)):
            low, high = min(low, recent[k, i]), max(high, recent[k, i])
        outside = max(low - measured[i], measured[i] - high)
        if outside > worst:
            worst, joint = outside, i
    return joint


class Follower:
    """The guarded set-points of one arm, held back to where the arm is when it does not follow.

    While the arm is stopped, guided by hand, or farther from its recent set-points than the bound,
    set-points go to the measured joints within all limits. From there the run resumes as soon as
    the arm is free; a run that waited for longer than `patience_s` ends.

    Args:
        arm: with its limits.
        name: of the arm.
        start: measured joints at the start, (n,).
        dt: inner period, s.
        bound: how far the arm may be from its set-points.
        patience_s: how long to wait for it.
    """

    def __init__(
        self,
        arm: Arm,
        name: str,
        start: FloatArray,
        dt: float,
        bound: FollowingBound,
        patience_s: float,
    ) -> None:
        self.guard = Guard(arm, start, dt)
        self.guard.approach(start)  # compiles or loads what a hold needs; it moves nothing
        self.holding: Fault | None = None  # why the arm is held, if it is
        self._name, self._names = name, arm.names
        self._bound, self._patience_s = bound, patience_s
        self._recent = np.tile(start, (max(round(bound.lag_s / dt), 1), 1))
        self._tick = 0
        self._scale = 1.0
        self._anchor = start  # where set-points go while the arm is held
        self._since, self._freed = 0.0, -np.inf  # s, when the arm was held first, and freed last
        self._held_at = np.full(arm.joint_count, np.inf)

    def observe(self, time: float, measured: FloatArray, robot: RobotState | None) -> Fault | None:
        """Take note of where the arm is; return why the run ends, if it was held for too long."""
        row, self._tick = self._tick % len(self._recent), self._tick + 1
        bound = self._bound.offset
        joint = farthest_joint(measured, self.guard.position, self._recent, row, bound)
        if robot is not None:
            self._scale = robot.speed_scale
        if joint < 0 and self.holding is None and (robot is None or robot.running):
            return None
        return self._hold(time, measured, self._reason(joint, measured, robot))

    def step(self, wanted: FloatArray) -> Setpoint:
        """Return the next set-point, at desired rates (n,) or on the way to the measured joints."""
        if self.holding is not None:
            return self.guard.approach(self._anchor)
        return self.guard.step(wanted if self._scale == 1.0 else self._scale * wanted)

    def _reason(self, joint: int, measured: FloatArray, robot: RobotState | None) -> Fault | None:
        if robot is not None and not robot.running:
            reason = f"{self._name} reports: {robot.mode.value}"
            return Fault(OutcomeKind.PROTECTIVE_STOP, reason)
        if joint < 0:
            return None
        gap = abs(float(measured[joint] - self.guard.position[joint]))
        reason = f"{self._names[joint]} of {self._name} is {gap:.3g} from its set-point"
        return Fault(OutcomeKind.NOT_FOLLOWING, reason)

    def _hold(self, time: float, measured: FloatArray, reason: Fault | None) -> Fault | None:
        """Begin, continue or end a hold; return why the run ends, if it does."""
        if reason is not None:
            moved = np.abs(measured - self._held_at).max() > self._bound.offset
            if self.holding is None and (moved or time - self._freed > self._patience_s):
                self._since, self._held_at = time, measured
            # An arm that does not follow is met where it was found, not chased: its sensors may
            # be biased. One that is stopped or guided by hand is kept up with.
            if self.holding is None or reason.kind is OutcomeKind.PROTECTIVE_STOP:
                self._anchor = measured
            self.holding = reason
        elif self._anchored(measured):
            self.holding, self._freed = None, time
            return None
        emergency = reason is not None and RobotMode.EMERGENCY_STOP.value in reason.reason
        return self.holding if emergency or time - self._since > self._patience_s else None

    def _anchored(self, measured: FloatArray) -> bool:
        gap = float(np.abs(self.guard.position - measured).max())
        return gap < 0.5 * self._bound.offset and not self.guard.moving
