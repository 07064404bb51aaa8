"""Checks everything that enters the loop: samples, images, clocks, commands."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from math import isfinite

import numpy as np

from vergence.arrays import FloatArray
from vergence.robot import Arm
from vergence.runtime.driver import Driver
from vergence.runtime.endings import Fault, bad_command, bad_sample, clock_error
from vergence.runtime.image_check import ImageCheck
from vergence.runtime.joint_check import JointCheck
from vergence.signals import Frame, JointCommand, Sample

_FROZEN_S = 0.1  # the clock may lag this far behind the ticks,
_SLOW = 0.95  # beyond running at this fraction of its nominal rate,
_JUMP_S = 1.0  # and advance by this much from one tick to the next while an arm moves


class Border:
    """Checks every sample and every command once.

    After that, every joint array is finite, contiguous and of its arm's length, and every image is
    new, recent, and of its camera's size and type. A check takes about a microsecond per tick.

    Args:
        driver: defines the arms and cameras.
        at_rest: returns whether no set-point moves; only then may the clock jump.
        image_age_s: largest age of an image on arrival.
    """

    def __init__(self, driver: Driver, at_rest: Callable[[], bool], image_age_s: float) -> None:
        self._arms: Mapping[str, Arm] = driver.arms
        self._dt = 1.0 / driver.inner_rate_hz
        self._least_s = _SLOW * self._dt  # the least advance of the clock in a tick
        self._at_rest = at_rest
        self._images = ImageCheck(driver.cameras, image_age_s)
        self._joints = [JointCheck(name, arm) for name, arm in self._arms.items()]
        self._origin: float | None = None  # the driver's time at the start of the run, s
        self._time = 0.0  # of the driver at the last sample, s
        self._behind = 0.0  # s by which the clock lags behind the ticks

    @property
    def time(self) -> float:
        """Time of the last sample since the start of the run, s."""
        return self._time - self._origin if self._origin else self._time

    def admit(self, sample: Sample) -> Sample | Fault:
        """Return the sample with its new images only, or the fault in it."""
        try:
            time = sample.time
            if self._origin is None:
                self._origin = self._time = float(time)
            elapsed = time - self._time
            behind = self._behind + self._least_s - elapsed
            self._behind = behind if behind > 0.0 else 0.0
            steady = 0.0 <= elapsed <= _JUMP_S and behind <= _FROZEN_S
            if not steady and (fault := self._check_clock(time, elapsed)):
                return fault
            self._time = time
            since_s = elapsed if elapsed > self._dt else self._dt
            for joints in self._joints:
                if fault := joints.check(sample, since_s):
                    return fault
            return self._with_new_frames(sample) if sample.frames else sample
        except (AttributeError, TypeError, ValueError, KeyError, IndexError) as error:
            return bad_sample(f"the driver's sample cannot be read: {error}")

    def in_run_time(self, sample: Sample) -> Sample:
        """Return an admitted sample with times relative to the start of the run."""
        start = self._origin
        if not start:
            return sample
        joints = {
            name: replace(state, time=state.time - start) for name, state in sample.joints.items()
        }
        frames = tuple(replace(frame, time=frame.time - start) for frame in sample.frames)
        return replace(sample, time=sample.time - start, joints=joints, frames=frames)

    def check_command(self, arm: str, command: JointCommand) -> Fault | None:
        """Return the fault in a law's command for an arm, if any."""
        if not isinstance(command, JointCommand):
            return bad_command(f"the law returned {type(command).__name__}, not a JointCommand")
        return self.check_rates(arm, command.velocity)

    def check_rates(self, arm: str, rates: FloatArray) -> Fault | None:
        """Return the fault in joint rates (n,) for an arm, if any."""
        names = self._arms[arm].names
        if not isinstance(rates, np.ndarray) or rates.dtype.kind not in "fiu":
            kind = getattr(rates, "dtype", type(rates).__name__)
            return bad_command(f"the law's rates are {kind}, not float64")
        if rates.shape != (len(names),):
            return bad_command(f"the law's rates have shape {rates.shape} for {len(names)} joints")
        # A finite sum has finite terms; only otherwise is each term checked.
        if isfinite(sum(rates.tolist())) or np.isfinite(rates).all():
            return None
        first = names[int(np.argmin(np.isfinite(rates)))]
        return bad_command(f"the law's rate of {first} is not finite")

    def _check_clock(self, time: float, elapsed: float) -> Fault | None:
        """Return the fault of a clock that went backwards, jumped ahead or hardly advanced."""
        if 0.0 <= elapsed < np.inf and self._behind > _FROZEN_S:
            return clock_error(f"the driver's clock stays at {time:.3f} s while set-points go out")
        if 0.0 <= elapsed < np.inf and self._at_rest():
            return None
        return clock_error(
            f"the driver's clock went from {self._time:.3f} s to {time:.3f} s in one tick"
        )

    def _with_new_frames(self, sample: Sample) -> Sample | Fault:
        new = []
        for frame in sample.frames:
            fault = self._check_exposure(frame) or self._images.check(frame, sample)
            if isinstance(fault, Fault):
                return fault
            if fault:
                new.append(frame)
        return sample if len(new) == len(sample.frames) else replace(sample, frames=tuple(new))

    def _check_exposure(self, frame: Frame) -> Fault | None:
        """Return the fault in the joint positions at an exposure, if any."""
        for arm, position in frame.joints.items():
            known = self._arms.get(arm)
            if known is None:
                continue
            if position.shape != (known.joint_count,) or not np.isfinite(position).all():
                return bad_sample(
                    f"the joints of {arm} at an exposure of {frame.camera} are unusable"
                )
        return None
