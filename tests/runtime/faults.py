"""Drivers and laws that misbehave from some moment on, each in one way of its own."""

import signal
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from scripted_cell import ScriptedDriver

from vergence.errors import DriverSilent
from vergence.signals import (
    Frame,
    JointCommand,
    JointState,
    Observation,
    OutcomeKind,
    Reference,
    RobotMode,
    RobotState,
    Sample,
    Setpoint,
)

K = OutcomeKind


@dataclass
class FaultyDriver(ScriptedDriver):
    """A scripted driver with noisy images, and with one fault from a time on."""

    fault: str = ""
    at: float = 0.4
    rng: np.random.Generator = field(default_factory=lambda: np.random.default_rng(0))
    handed: list[Mapping[str, Setpoint]] = field(default_factory=list)  # also those refused
    memory: dict[str, Any] = field(default_factory=dict)

    @property
    def on(self) -> bool:
        return self.time >= self.at

    def read(self) -> Sample:
        sample = super().read()
        joints = {arm: state.position for arm, state in sample.joints.items()}
        frames = tuple(
            replace(f, image=self.rng.integers(0, 255, (48, 64), np.uint8), joints=joints)
            for f in sample.frames
        )
        sample = replace(sample, frames=frames)
        spoil = SAMPLE_FAULTS.get(self.fault, (None, None))[1]
        return spoil(sample, self) if spoil is not None and self.on else sample

    def step(self, setpoints: Mapping[str, Setpoint]) -> None:
        self.handed.append(setpoints)
        if self.on and self.fault in STEP_FAULTS:
            STEP_FAULTS[self.fault][1](self)
        before = dict(self.q)
        super().step(setpoints)
        if self.on and self.fault in MOTION_FAULTS:
            self.q = MOTION_FAULTS[self.fault][1](before, self)


def joints_as(change: Callable[[JointState], JointState]) -> Callable[[Sample, Any], Sample]:
    def spoil(sample: Sample, driver: FaultyDriver) -> Sample:
        return replace(sample, joints={n: change(s) for n, s in sample.joints.items()})

    return spoil


def frames_as(change: Callable[[Frame], Frame]) -> Callable[[Sample, Any], Sample]:
    def spoil(sample: Sample, driver: FaultyDriver) -> Sample:
        return replace(sample, frames=tuple(change(f) for f in sample.frames))

    return spoil


def image_as(change: Callable[[Any], Any]) -> Callable[[Sample, Any], Sample]:
    return frames_as(lambda frame: replace(frame, image=change(frame.image)))


def time_as(change: Callable[[float, Any], Any]) -> Callable[[Sample, Any], Sample]:
    return lambda sample, driver: replace(sample, time=change(sample.time, driver))


def robot_as(**state: Any) -> Callable[[Sample, Any], Sample]:
    return lambda sample, driver: replace(sample, robots={"left": RobotState(**state)})


def all_back(sample: Sample, driver: FaultyDriver) -> Sample:
    joints = {n: replace(s, time=s.time - 5) for n, s in sample.joints.items()}
    frames = tuple(replace(f, time=f.time - 5) for f in sample.frames)
    return replace(sample, time=sample.time - 5, joints=joints, frames=frames)


def late(by_s: float) -> Callable[[Sample, FaultyDriver], Sample]:
    def spoil(sample: Sample, driver: FaultyDriver) -> Sample:
        held = driver.memory.setdefault("held", [])
        held.extend(sample.frames)
        due = [f for f in held if driver.time - f.time >= by_s]
        driver.memory["held"] = [f for f in held if driver.time - f.time < by_s]
        return replace(sample, frames=tuple(due))

    return spoil


def frozen_camera(sample: Sample, driver: FaultyDriver) -> Sample:
    def again(frame: Frame) -> Frame:
        first = driver.memory.setdefault(frame.camera, frame)
        return replace(first, time=frame.time)

    return frames_as(again)(sample, driver)


def dropped(share: float) -> Callable[[Sample, FaultyDriver], Sample]:
    return lambda sample, driver: replace(
        sample, frames=tuple(f for f in sample.frames if driver.rng.random() >= share)
    )


def raising(error: BaseException) -> Callable[..., Any]:
    def fail(*arguments: Any) -> Any:
        raise error

    return fail


def once(error: BaseException) -> Callable[[FaultyDriver], None]:
    def fail(driver: FaultyDriver) -> None:
        if not driver.memory.setdefault("raised", False):
            driver.memory["raised"] = True
            raise error

    return fail


def signalled(name: str) -> Callable[[FaultyDriver], None]:
    def press(driver: FaultyDriver) -> None:
        if not driver.memory.setdefault("pressed", False):
            driver.memory["pressed"] = True
            signal.raise_signal(getattr(signal, name))

    return press


def stuck(for_s: float) -> Callable[[Mapping[str, Any], FaultyDriver], dict[str, Any]]:
    def hold(before: Mapping[str, Any], driver: FaultyDriver) -> dict[str, Any]:
        return dict(before) if driver.time < driver.at + for_s else driver.q

    return hold


def nan_of(values: Any) -> Any:
    return np.full_like(values, np.nan)


CLOCK, SAMPLE, GOES_ON = {K.CLOCK_ERROR}, {K.BAD_SAMPLE}, {K.COMPLETED}
# A fault's name: how a run with it may end, and what it does to a sample.
SAMPLE_FAULTS: dict[str, tuple[set[OutcomeKind], Callable[[Sample, Any], Any]]] = {
    "clock back 5 s": (CLOCK, all_back),
    "clock of the sample back 1 ms": (CLOCK, time_as(lambda t, d: t - 3e-3)),
    "clock frozen": (CLOCK | SAMPLE, time_as(lambda t, d: d.at)),
    "clock frozen with its joints": (
        CLOCK | {K.IMAGE_LATE},
        lambda s, d: Sample(d.at, {n: replace(j, time=d.at) for n, j in s.joints.items()}, ()),
    ),
    "clock not a number": (CLOCK, time_as(lambda t, d: float("nan"))),
    "clock infinite": (CLOCK, time_as(lambda t, d: float("inf"))),
    "clock 1e9 s ahead": (CLOCK, time_as(lambda t, d: t + 1e9)),
    "clock at half speed": (CLOCK | SAMPLE, time_as(lambda t, d: d.at + 0.5 * (t - d.at))),
    "clock of None": (SAMPLE, time_as(lambda t, d: None)),
    "clock a word": (SAMPLE, time_as(lambda t, d: "now")),
    "no sample": (SAMPLE, lambda s, d: None),
    "joints not numbers": (SAMPLE, joints_as(lambda s: replace(s, position=nan_of(s.position)))),
    "one joint infinite": (
        SAMPLE,
        joints_as(lambda s: replace(s, position=[*s.position[:-1], np.inf])),
    ),
    "velocities not numbers": (
        SAMPLE,
        joints_as(lambda s: replace(s, velocity=nan_of(s.velocity))),
    ),
    "a joint too few": (
        SAMPLE,
        joints_as(lambda s: JointState(s.time, s.position[1:], s.velocity[1:])),
    ),
    "a joint too many": (
        SAMPLE,
        joints_as(lambda s: JointState(s.time, [*s.position, 0], [*s.velocity, 0])),
    ),
    "a velocity too few": (
        SAMPLE,
        joints_as(lambda s: JointState(s.time, s.position, s.velocity[1:])),
    ),
    "no joints": (SAMPLE, joints_as(lambda s: JointState(s.time, [], []))),
    "an arm missing": (SAMPLE, lambda s, d: replace(s, joints={})),
    "no state of an arm": (SAMPLE, lambda s, d: replace(s, joints=dict.fromkeys(s.joints))),
    "joints of None": (SAMPLE, lambda s, d: replace(s, joints=None)),
    "joints jump": (SAMPLE, joints_as(lambda s: replace(s, position=s.position + 0.5))),
    "joints jump far": (SAMPLE, joints_as(lambda s: replace(s, position=s.position - 1e9))),
    "joints old": (SAMPLE, joints_as(lambda s: replace(s, time=s.time - 0.3))),
    "joints of the future": (SAMPLE, joints_as(lambda s: replace(s, time=s.time + 0.3))),
    "joints without a time": (SAMPLE, joints_as(lambda s: replace(s, time=float("nan")))),
    "image half the size": (SAMPLE, image_as(lambda i: i[::2, ::2])),
    "image twice the size": (SAMPLE, image_as(lambda i: np.vstack((i, i)))),
    "image in colour": (SAMPLE, image_as(lambda i: np.dstack((i, i, i)))),
    "image of floats": (SAMPLE, image_as(lambda i: np.where(i > 9, np.nan, i.astype(float)))),
    "image of 16 bits": (SAMPLE, image_as(lambda i: i.astype(np.uint16) * 257)),
    "image of one pixel": (SAMPLE, image_as(lambda i: i[:1, :1])),
    "image empty": (SAMPLE, image_as(lambda i: i[:0])),
    "image a list": (SAMPLE, image_as(lambda i: [[1, 2], [3, 4]])),
    "image missing": (SAMPLE, image_as(lambda i: None)),
    "frames of None": (SAMPLE | {K.IMAGE_LATE}, lambda s, d: replace(s, frames=None)),
    "frame of None": (SAMPLE, lambda s, d: replace(s, frames=(None,))),
    "unknown camera": (SAMPLE, frames_as(lambda f: replace(f, camera="zzz"))),
    "exposure not a number": (CLOCK, frames_as(lambda f: replace(f, time=float("nan")))),
    "exposure in the future": (CLOCK, frames_as(lambda f: replace(f, time=f.time + 10))),
    "exposure long ago": ({K.IMAGE_LATE}, frames_as(lambda f: replace(f, time=f.time - 10))),
    "joints at exposure not numbers": (
        SAMPLE,
        frames_as(lambda f: replace(f, joints={n: nan_of(q) for n, q in f.joints.items()})),
    ),
    "joints at exposure too few": (
        SAMPLE,
        frames_as(lambda f: replace(f, joints={n: q[1:] for n, q in f.joints.items()})),
    ),
    "images twice": (GOES_ON, lambda s, d: replace(s, frames=s.frames * 2)),
    "images backwards": (GOES_ON, lambda s, d: replace(s, frames=s.frames[::-1])),
    "images 0.3 s late": (GOES_ON, late(0.3)),
    "images 3 s late": ({K.IMAGE_LATE}, late(3.0)),
    "camera frozen": ({K.CAMERA_FROZEN}, frozen_camera),
    "stamp frozen": ({K.IMAGE_LATE}, frames_as(lambda f: replace(f, time=0.4))),
    "every image dropped": ({K.IMAGE_LATE}, dropped(1.0)),
    "nine images in ten dropped": (GOES_ON | {K.IMAGE_LATE}, dropped(0.9)),
    "protective stop": ({K.PROTECTIVE_STOP}, robot_as(mode=RobotMode.PROTECTIVE_STOP)),
    "emergency stop": ({K.PROTECTIVE_STOP}, robot_as(mode=RobotMode.EMERGENCY_STOP)),
    "hand-guided": ({K.PROTECTIVE_STOP}, robot_as(mode=RobotMode.HAND_GUIDED)),
    "speed slider at half": (GOES_ON, robot_as(speed_scale=0.5)),
    "speed slider at zero": (GOES_ON, robot_as(speed_scale=0.0)),
    "speed slider not a number": (SAMPLE, robot_as(speed_scale=float("nan"))),
    "speed slider at 200 %": (SAMPLE, robot_as(speed_scale=2.0)),
    "read raises OSError": ({K.PART_RAISED}, raising(OSError("gone"))),
    "read raises KeyError": ({K.PART_RAISED}, raising(KeyError("left"))),
    "read raises DriverSilent": ({K.DRIVER_SILENT}, raising(DriverSilent("silent"))),
}
STEP_FAULTS: dict[str, tuple[set[OutcomeKind], Callable[[FaultyDriver], None]]] = {
    "step raises OSError": ({K.PART_RAISED}, raising(OSError("gone"))),
    "step raises ValueError": ({K.PART_RAISED}, raising(ValueError("bad"))),
    "step raises once": ({K.PART_RAISED}, once(RuntimeError("once"))),
    "step raises DriverSilent": ({K.DRIVER_SILENT}, raising(DriverSilent("silent"))),
    "step is interrupted": ({K.STOPPED}, once(KeyboardInterrupt())),
    "SIGINT": ({K.STOPPED}, signalled("SIGINT")),
    "SIGTERM": ({K.STOPPED}, signalled("SIGTERM")),
    "SIGHUP": ({K.STOPPED}, signalled("SIGHUP")),
}
MOTION_FAULTS: dict[str, tuple[set[OutcomeKind], Callable[..., dict[str, Any]]]] = {
    "arm stuck": ({K.NOT_FOLLOWING}, stuck(np.inf)),
    "arm stuck for a while": (GOES_ON, stuck(0.4)),
}
DRIVER_FAULTS = {
    **{name: ends for name, (ends, _) in SAMPLE_FAULTS.items()},
    **{name: ends for name, (ends, _) in STEP_FAULTS.items()},
    **{name: ends for name, (ends, _) in MOTION_FAULTS.items()},
}

RAISED, COMMAND = {K.PART_RAISED}, {K.BAD_COMMAND}
LIMITED = GOES_ON | {K.JOINT_LIMIT}
# A fault's name: how a run with it may end, and what the law answers with in place of its rates.
LAW_FAULTS: dict[str, tuple[set[OutcomeKind], Callable[[Any, np.random.Generator], Any]]] = {
    "not numbers": (COMMAND, lambda v, rng: nan_of(v)),
    "one not a number": (COMMAND, lambda v, rng: np.array([*v[:-1], np.nan])),
    "infinite": (COMMAND, lambda v, rng: np.full_like(v, np.inf)),
    "minus infinite": (COMMAND, lambda v, rng: np.full_like(v, -np.inf)),
    "none": (COMMAND, lambda v, rng: np.zeros(0)),
    "one": (COMMAND, lambda v, rng: np.ones(1)),
    "too few": (COMMAND, lambda v, rng: v[1:]),
    "too many": (COMMAND, lambda v, rng: np.concatenate((v, v))),
    "a column": (COMMAND, lambda v, rng: v[:, None]),
    "a row": (COMMAND, lambda v, rng: v[None]),
    "a scalar": (COMMAND, lambda v, rng: np.float64(0.1)),
    "a list": (COMMAND, lambda v, rng: v.tolist()),
    "a word": (COMMAND, lambda v, rng: "fast"),
    "None": (COMMAND, lambda v, rng: None),
    "objects": (COMMAND, lambda v, rng: v.astype(object)),
    "complex": (COMMAND, lambda v, rng: v + 1j),
    "truths": (COMMAND, lambda v, rng: v > 0),
    "strings": (COMMAND, lambda v, rng: v.astype(str)),
    "whole numbers": (LIMITED, lambda v, rng: np.sign(v).astype(np.int64)),
    "single precision": (LIMITED, lambda v, rng: v.astype(np.float32)),
    "read-only": (LIMITED, lambda v, rng: np.broadcast_to(v[:1], v.shape)),
    "every other of an array": (LIMITED, lambda v, rng: np.repeat(v, 2)[::2]),
    "backwards": (LIMITED, lambda v, rng: v[::-1]),
    "huge": (LIMITED, lambda v, rng: 1e300 * np.sign(v)),
    "beyond the limits": (LIMITED, lambda v, rng: 100.0 * v),
    "tiny": (LIMITED, lambda v, rng: 5e-324 * np.ones_like(v)),
    "to and fro": (LIMITED, lambda v, rng: rng.choice([-1e3, 1e3], len(v))),
    "random": (LIMITED, lambda v, rng: rng.normal(0, 10.0 ** rng.uniform(-3, 6), len(v))),
    "raises ValueError": (RAISED, raising(ValueError("singular"))),
    "raises ZeroDivisionError": (RAISED, raising(ZeroDivisionError("division by zero"))),
    "raises MemoryError": (RAISED, raising(MemoryError())),
    "raises StopIteration": (RAISED, raising(StopIteration())),
    "raises RecursionError": (RAISED, raising(RecursionError("too deep"))),
    "interrupts": ({K.STOPPED}, raising(KeyboardInterrupt())),
}


@dataclass
class FaultyLaw:
    """Asks for the same rates at every image, until its fault sets in."""

    rates: Any
    fault: str = ""
    at: float = 0.4
    rng: np.random.Generator = field(default_factory=lambda: np.random.default_rng(0))

    def command(
        self, observation: Observation, reference: Reference, joints: JointState
    ) -> JointCommand:
        rates = self.rates
        if self.fault and joints.time >= self.at:
            rates = LAW_FAULTS[self.fault][1](rates, self.rng)
        return JointCommand(rates, np.zeros(6))
