"""The one place where what crosses into the loop is checked: samples, images, clocks, commands."""

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np
from numba import njit

from vergence.arrays import FloatArray
from vergence.robot import Arm
from vergence.runtime.driver import Driver
from vergence.runtime.endings import Fault, bad_sample
from vergence.runtime.image_check import EARLY_S, ImageCheck
from vergence.signals import Frame, JointCommand, JointState, OutcomeKind, Sample

_STALE_S = 0.1  # joints may be so old
_FROZEN_S = 0.1  # the clock may fall so far behind the ticks,
_SLOW = 0.95  # beyond running so slow, as a share of its nominal rate,
_JUMP_S = 1.0  # and advance by so much from one tick to the next while an arm moves
_RATE_MARGIN = 3.0  # a joint moves at most so many times its rate limit
_NOISE = 0.01  # rad or m that a joint may move in no time: resolution, vibration


@njit(cache=True, error_model="numpy")
def first_implausible(
    position: FloatArray, velocity: FloatArray, last: FloatArray, reach: FloatArray, elapsed: float
) -> int:
    """Return i if joint i is not finite, n + i if it moved too far since the last sample, else -1.

    Args:
        position: measured, (n,).
        velocity: measured, (n,).
        last: positions of the last sample, (n,), NaN before the first; overwritten.
        reach: the fastest that a joint may be seen to move, (n,).
        elapsed: time since the last sample, s.
    """
    n = len(position)
    for i in range(n):
        if not (np.isfinite(position[i]) and np.isfinite(velocity[i])):
            return i
        if abs(position[i] - last[i]) > reach[i] * elapsed + _NOISE:
            return n + i
    last[:] = position
    return -1


class Border:
    """Checks every sample and every command once.

    Behind it, times count from the start of the run, every joint array is finite, contiguous and of
    its arm's length, and every image is new, recent, and of its camera's size and type.

    Args:
        driver: says which arms and cameras there are.
        at_rest: whether no set-point moves; the clock may then jump.
        image_age_s: how old an image may be when it arrives.
    """

    def __init__(self, driver: Driver, at_rest: Callable[[], bool], image_age_s: float) -> None:
        self._arms: Mapping[str, Arm] = driver.arms
        self._dt = 1.0 / driver.inner_rate_hz
        self._at_rest = at_rest
        self._images = ImageCheck(driver.cameras, image_age_s)
        self._origin: float | None = None  # the driver's time at the start of the run, s
        self._time = 0.0
        self._behind = 0.0  # s by which the clock has fallen behind the ticks
        self._last = {name: np.full(arm.joint_count, np.nan) for name, arm in self._arms.items()}
        self._reach = {name: _RATE_MARGIN * arm.rate_max for name, arm in self._arms.items()}

    def admit(self, sample: Sample) -> Sample | Fault:
        """Return the sample in the run's time with its new images, or what is wrong with it."""
        try:
            return self._admit(sample)
        except (AttributeError, TypeError, ValueError, KeyError, IndexError) as error:
            return Fault(OutcomeKind.BAD_SAMPLE, f"the driver's sample cannot be read: {error}")

    def check_command(self, arm: str, command: JointCommand) -> Fault | None:
        """Say what is wrong with a law's command for an arm."""
        if not isinstance(command, JointCommand):
            reason = f"the law returned {type(command).__name__}, not a JointCommand"
            return Fault(OutcomeKind.BAD_COMMAND, reason)
        return self.check_rates(arm, command.velocity)

    def check_rates(self, arm: str, rates: FloatArray) -> Fault | None:
        """Say what is wrong with joint rates (n,) for an arm."""
        names = self._arms[arm].names
        if not isinstance(rates, np.ndarray) or rates.dtype.kind not in "fiu":
            kind = getattr(rates, "dtype", type(rates).__name__)
            return Fault(OutcomeKind.BAD_COMMAND, f"the law's rates are {kind}, not float64")
        if rates.shape != (len(names),):
            given = f"shape {rates.shape} for {len(names)} joints"
            return Fault(OutcomeKind.BAD_COMMAND, f"the law's rates have {given}")
        if not np.isfinite(rates).all():
            first = names[int(np.argmin(np.isfinite(rates)))]
            return Fault(OutcomeKind.BAD_COMMAND, f"the law's rate of {first} is not finite")
        return None

    def _admit(self, sample: Sample) -> Sample | Fault:
        if self._origin is None:
            self._origin = self._time = float(sample.time)
            self._behind = 0.0
        time = float(sample.time)
        elapsed = time - self._time
        if fault := self._check_clock(time, elapsed):
            return fault
        self._time = time
        for name in self._arms:
            if fault := self._check_joints(name, sample, max(elapsed, self._dt)):
                return fault
        frames: tuple[Frame, ...] = ()
        if sample.frames:
            admitted = self._check_frames(sample)
            if isinstance(admitted, Fault):
                return admitted
            frames = admitted
        return self._in_run_time(sample, frames)

    def _check_clock(self, time: float, elapsed: float) -> Fault | None:
        if elapsed >= 0.0:
            self._behind = max(self._behind + _SLOW * self._dt - elapsed, 0.0)
            if self._behind > _FROZEN_S:
                reason = f"the driver's clock stands at {time:.3f} s while set-points go on"
                return Fault(OutcomeKind.CLOCK_ERROR, reason)
            if elapsed <= _JUMP_S or (np.isfinite(elapsed) and self._at_rest()):
                return None
        reason = f"the driver's clock went from {self._time:.3f} s to {time:.3f} s in one tick"
        return Fault(OutcomeKind.CLOCK_ERROR, reason)

    def _check_joints(self, arm: str, sample: Sample, elapsed: float) -> Fault | None:
        state = sample.joints.get(arm)
        names, last = self._arms[arm].names, self._last[arm]
        if not isinstance(state, JointState) or len(state.position) != len(names):
            given = f"{len(state.position)} joints" if isinstance(state, JointState) else "no state"
            return bad_sample(f"{given} of {arm}, which has {len(names)} joints")
        if len(state.velocity) != len(names):
            return bad_sample(
                f"{len(state.velocity)} joint velocities of {arm} for {len(names)} joints"
            )
        age = sample.time - state.time
        if not -EARLY_S <= age <= _STALE_S:
            return bad_sample(f"joints of {arm} are {age:.3f} s old")
        joint = first_implausible(state.position, state.velocity, last, self._reach[arm], elapsed)
        if joint < 0:
            return self._check_robot(arm, sample)
        name, position = names[joint % len(names)], float(state.position[joint % len(names)])
        if joint >= len(names):
            before = float(last[joint % len(names)])
            return bad_sample(
                f"{name} of {arm} went from {before:.4g} to {position:.4g} in {elapsed:.3g} s"
            )
        return bad_sample(f"{name} of {arm} is not finite")

    def _check_robot(self, arm: str, sample: Sample) -> Fault | None:
        state = sample.robots.get(arm) if sample.robots else None
        if state is not None and not 0.0 <= state.speed_scale <= 1.0:
            return bad_sample(f"the speed scale of {arm} is {state.speed_scale}, outside 0 to 1")
        return None

    def _check_frames(self, sample: Sample) -> tuple[Frame, ...] | Fault:
        new = []
        for frame in sample.frames:
            for arm, position in frame.joints.items():
                known = self._arms.get(arm)
                if known is None:
                    continue
                if position.shape != (known.joint_count,) or not np.isfinite(position).all():
                    return bad_sample(
                        f"the joints of {arm} at an exposure of {frame.camera} are unusable"
                    )
            fault = self._images.check(frame, sample)
            if isinstance(fault, Fault):
                return fault
            if fault:
                new.append(frame)
        return tuple(new)

    def _in_run_time(self, sample: Sample, frames: tuple[Frame, ...]) -> Sample:
        """Return the sample with times since the start of the run."""
        start = self._origin
        if not start:
            return sample if len(frames) == len(sample.frames) else replace(sample, frames=frames)
        joints = {
            name: replace(state, time=state.time - start) for name, state in sample.joints.items()
        }
        moved = tuple(replace(frame, time=frame.time - start) for frame in frames)
        return replace(sample, time=sample.time - start, joints=joints, frames=moved)
