"""The ways in which a driver may misbehave that every run has to survive."""

import signal
from collections.abc import Callable
from dataclasses import replace
from typing import Any, TypeAlias

import numpy as np

from vergence.errors import DriverSilent
from vergence.signals import (
    Frame,
    JointState,
    OutcomeKind,
    RobotMode,
    RobotState,
    Sample,
    Setpoint,
)
from vergence.studies.guarantees.faulty_driver import DriverFault, FaultyDriver, Setpoints
from vergence.studies.guarantees.law_faults import raising

K = OutcomeKind
Spoil: TypeAlias = Callable[[Sample, FaultyDriver], Any]
Motion: TypeAlias = Callable[[Setpoints, FaultyDriver], Setpoints]


def _spoilt(value: Any, **changes: Any) -> Any:
    """Return a value with changes that its types need not allow."""
    return replace(value, **changes)


def _joints_as(change: Callable[[JointState], JointState]) -> Spoil:
    def spoil(sample: Sample, _driver: FaultyDriver) -> Any:
        return _spoilt(sample, joints={n: change(s) for n, s in sample.joints.items()})

    return spoil


def _frames_as(change: Callable[[Frame], Any]) -> Spoil:
    def spoil(sample: Sample, _driver: FaultyDriver) -> Any:
        return _spoilt(sample, frames=tuple(change(f) for f in sample.frames))

    return spoil


def _image_as(change: Callable[[Any], Any]) -> Spoil:
    return _frames_as(lambda frame: _spoilt(frame, image=change(frame.image)))


def _time_as(change: Callable[[float, Any], Any]) -> Spoil:
    return lambda sample, driver: _spoilt(sample, time=change(sample.time, driver))


def _robot_as(**state: Any) -> Spoil:
    return lambda sample, _driver: _spoilt(
        sample, robots=dict.fromkeys(sample.joints, RobotState(**state))
    )


def _all_back(sample: Sample, _driver: FaultyDriver) -> Any:
    joints = {n: _spoilt(s, time=s.time - 5) for n, s in sample.joints.items()}
    frames = tuple(_spoilt(f, time=f.time - 5) for f in sample.frames)
    return _spoilt(sample, time=sample.time - 5, joints=joints, frames=frames)


def _late(by_s: float) -> Spoil:
    def spoil(sample: Sample, driver: FaultyDriver) -> Any:
        held = driver.memory.setdefault("held", [])
        held.extend(sample.frames)
        due = [f for f in held if driver.time - f.time >= by_s]
        driver.memory["held"] = [f for f in held if driver.time - f.time < by_s]
        return _spoilt(sample, frames=tuple(due))

    return spoil


def _frozen_camera(sample: Sample, driver: FaultyDriver) -> Any:
    def again(frame: Frame) -> Any:
        first = driver.memory.setdefault(frame.camera, frame)
        return _spoilt(first, time=frame.time)

    return _frames_as(again)(sample, driver)


def _dropped(share: float) -> Spoil:
    return lambda sample, driver: _spoilt(
        sample, frames=tuple(f for f in sample.frames if driver.rng.random() >= share)
    )


def _once(error: BaseException) -> Callable[[FaultyDriver], None]:
    def fail(driver: FaultyDriver) -> None:
        if not driver.memory.setdefault("raised", False):
            driver.memory["raised"] = True
            raise error

    return fail


def _signalled(name: str) -> Callable[[FaultyDriver], None]:
    def press(driver: FaultyDriver) -> None:
        if not driver.memory.setdefault("pressed", False):
            driver.memory["pressed"] = True
            number = getattr(signal, name)
            before = signal.pthread_sigmask(signal.SIG_UNBLOCK, {number})  # workers block Ctrl-C
            signal.raise_signal(number)
            signal.pthread_sigmask(signal.SIG_SETMASK, before)

    return press


def _stuck(for_s: float) -> Motion:
    """Return what an arm follows that is blocked, and then catches up as fast as it may."""

    def hold(setpoints: Setpoints, driver: FaultyDriver) -> Setpoints:
        free_s = max(driver.time - driver.at - for_s, 0.0)
        followed = {}
        for name, setpoint in setpoints.items():
            start = driver.memory.setdefault(name, setpoint.position)
            reach = driver.arms[name].rate_max * free_s
            q = start + np.clip(setpoint.position - start, -reach, reach)
            followed[name] = Setpoint(q, np.zeros_like(q))
        return followed

    return hold


def _nan_of(values: Any) -> Any:
    return np.full_like(values, np.nan)


CLOCK, SAMPLE, LATE = (frozenset({k}) for k in (K.CLOCK_ERROR, K.BAD_SAMPLE, K.IMAGE_LATE))
GOES_ON, HELD, STOPPED = (frozenset({k}) for k in (K.COMPLETED, K.PROTECTIVE_STOP, K.STOPPED))
RAISED, SILENT = (frozenset({k}) for k in (K.PART_RAISED, K.DRIVER_SILENT))
_OF_SAMPLES: dict[str, DriverFault] = {
    "clock back 5 s": DriverFault(CLOCK, _all_back),
    "clock of the sample back 1 ms": DriverFault(CLOCK, _time_as(lambda t, _d: t - 3e-3)),
    "clock frozen": DriverFault(CLOCK | SAMPLE, _time_as(lambda _t, d: d.at)),
    "clock frozen with its joints": DriverFault(
        CLOCK | LATE,
        lambda s, d: Sample(d.at, {n: _spoilt(j, time=d.at) for n, j in s.joints.items()}, ()),
    ),
    "clock not a number": DriverFault(CLOCK, _time_as(lambda _t, _d: float("nan"))),
    "clock infinite": DriverFault(CLOCK, _time_as(lambda _t, _d: float("inf"))),
    "clock 1e9 s ahead": DriverFault(CLOCK, _time_as(lambda t, _d: t + 1e9)),
    "clock at half speed": DriverFault(
        CLOCK | SAMPLE, _time_as(lambda t, d: d.at + 0.5 * (t - d.at))
    ),
    "clock of None": DriverFault(SAMPLE, _time_as(lambda _t, _d: None)),
    "clock a word": DriverFault(SAMPLE, _time_as(lambda _t, _d: "now")),
    "no sample": DriverFault(SAMPLE, lambda _s, _d: None),
    "joints not numbers": DriverFault(
        SAMPLE, _joints_as(lambda s: _spoilt(s, position=_nan_of(s.position)))
    ),
    "one joint infinite": DriverFault(
        SAMPLE,
        _joints_as(lambda s: _spoilt(s, position=[*s.position[:-1], np.inf])),
    ),
    "velocities not numbers": DriverFault(
        SAMPLE,
        _joints_as(lambda s: _spoilt(s, velocity=_nan_of(s.velocity))),
    ),
    "a joint too few": DriverFault(
        SAMPLE,
        _joints_as(lambda s: JointState(s.time, s.position[1:], s.velocity[1:])),
    ),
    "a joint too many": DriverFault(
        SAMPLE,
        _joints_as(
            lambda s: JointState(s.time, np.append(s.position, 0.0), np.append(s.velocity, 0.0))
        ),
    ),
    "a velocity too few": DriverFault(
        SAMPLE,
        _joints_as(lambda s: JointState(s.time, s.position, s.velocity[1:])),
    ),
    "no joints": DriverFault(
        SAMPLE, _joints_as(lambda s: JointState(s.time, np.empty(0), np.empty(0)))
    ),
    "an arm missing": DriverFault(SAMPLE, lambda s, _d: _spoilt(s, joints={})),
    "no state of an arm": DriverFault(
        SAMPLE, lambda s, _d: _spoilt(s, joints=dict.fromkeys(s.joints))
    ),
    "joints of None": DriverFault(SAMPLE, lambda s, _d: _spoilt(s, joints=None)),
    "joints jump": DriverFault(SAMPLE, _joints_as(lambda s: _spoilt(s, position=s.position + 0.5))),
    "joints jump far": DriverFault(
        SAMPLE, _joints_as(lambda s: _spoilt(s, position=s.position - 1e9))
    ),
    "joints old": DriverFault(SAMPLE, _joints_as(lambda s: _spoilt(s, time=s.time - 0.3))),
    "joints of the future": DriverFault(
        SAMPLE, _joints_as(lambda s: _spoilt(s, time=s.time + 0.3))
    ),
    "joints without a time": DriverFault(
        SAMPLE, _joints_as(lambda s: _spoilt(s, time=float("nan")))
    ),
    "image half the size": DriverFault(SAMPLE, _image_as(lambda i: i[::2, ::2])),
    "image twice the size": DriverFault(SAMPLE, _image_as(lambda i: np.vstack((i, i)))),
    "image in colour": DriverFault(SAMPLE, _image_as(lambda i: np.dstack((i, i, i)))),
    "image of floats": DriverFault(
        SAMPLE, _image_as(lambda i: np.where(i > 9, np.nan, i.astype(float)))
    ),
    "image of 16 bits": DriverFault(SAMPLE, _image_as(lambda i: i.astype(np.uint16) * 257)),
    "image of one pixel": DriverFault(SAMPLE, _image_as(lambda i: i[:1, :1])),
    "image empty": DriverFault(SAMPLE, _image_as(lambda i: i[:0])),
    "image a list": DriverFault(SAMPLE, _image_as(lambda _i: [[1, 2], [3, 4]])),
    "image missing": DriverFault(SAMPLE, _image_as(lambda _i: None)),
    "frames of None": DriverFault(SAMPLE | LATE, lambda s, _d: _spoilt(s, frames=None)),
    "frame of None": DriverFault(SAMPLE, lambda s, _d: _spoilt(s, frames=(None,))),
    "unknown camera": DriverFault(SAMPLE, _frames_as(lambda f: _spoilt(f, camera="zzz"))),
    "exposure not a number": DriverFault(
        CLOCK, _frames_as(lambda f: _spoilt(f, time=float("nan")))
    ),
    "exposure in the future": DriverFault(
        CLOCK, _frames_as(lambda f: _spoilt(f, time=f.time + 10))
    ),
    "exposure long ago": DriverFault(LATE, _frames_as(lambda f: _spoilt(f, time=f.time - 10))),
    "joints at exposure not numbers": DriverFault(
        SAMPLE,
        _frames_as(lambda f: _spoilt(f, joints={n: _nan_of(q) for n, q in f.joints.items()})),
    ),
    "joints at exposure too few": DriverFault(
        SAMPLE,
        _frames_as(lambda f: _spoilt(f, joints={n: q[1:] for n, q in f.joints.items()})),
    ),
    "images twice": DriverFault(GOES_ON, lambda s, _d: _spoilt(s, frames=s.frames * 2)),
    "images backwards": DriverFault(GOES_ON, lambda s, _d: _spoilt(s, frames=s.frames[::-1])),
    "images 0.3 s late": DriverFault(GOES_ON, _late(0.3)),
    "images 3 s late": DriverFault(LATE, _late(3.0)),
    "camera frozen": DriverFault(frozenset({K.CAMERA_FROZEN}), _frozen_camera),
    "stamp frozen": DriverFault(
        LATE, lambda s, d: _spoilt(s, frames=tuple(_spoilt(f, time=d.at) for f in s.frames))
    ),
    "every image dropped": DriverFault(LATE, _dropped(1.0)),
    "nine images in ten dropped": DriverFault(GOES_ON | LATE, _dropped(0.9)),
    "protective stop": DriverFault(HELD, _robot_as(mode=RobotMode.PROTECTIVE_STOP)),
    "stopped for a while": DriverFault(
        GOES_ON,
        lambda s, d: _robot_as(mode=RobotMode.PROTECTIVE_STOP)(s, d) if d.time < d.at + 0.3 else s,
        move=_stuck(0.3),
    ),
    "emergency stop": DriverFault(HELD, _robot_as(mode=RobotMode.EMERGENCY_STOP)),
    "hand-guided": DriverFault(HELD, _robot_as(mode=RobotMode.HAND_GUIDED)),
    "speed slider at half": DriverFault(GOES_ON, _robot_as(speed_scale=0.5)),
    "speed slider at zero": DriverFault(HELD, _robot_as(speed_scale=0.0)),
    "speed slider at zero for a while": DriverFault(
        GOES_ON, lambda s, d: _robot_as(speed_scale=float(d.time > d.at + 0.3))(s, d)
    ),
    "speed slider not a number": DriverFault(SAMPLE, _robot_as(speed_scale=float("nan"))),
    "speed slider at 200 %": DriverFault(SAMPLE, _robot_as(speed_scale=2.0)),
    "read raises OSError": DriverFault(RAISED, raising(OSError("gone"))),
    "read raises KeyError": DriverFault(RAISED, raising(KeyError("left"))),
    "read raises DriverSilent": DriverFault(SILENT, raising(DriverSilent("silent"))),
}
_OF_STEPS: dict[str, DriverFault] = {
    "step raises OSError": DriverFault(RAISED, refuse=raising(OSError("gone")), deaf=True),
    "step raises ValueError": DriverFault(RAISED, refuse=raising(ValueError("bad")), deaf=True),
    "step raises once": DriverFault(RAISED, refuse=_once(RuntimeError("once"))),
    "step raises DriverSilent": DriverFault(
        SILENT, refuse=raising(DriverSilent("silent")), deaf=True
    ),
    "step is interrupted": DriverFault(STOPPED, refuse=_once(KeyboardInterrupt())),
    "SIGINT": DriverFault(STOPPED, refuse=_signalled("SIGINT")),
    "SIGTERM": DriverFault(STOPPED, refuse=_signalled("SIGTERM")),
    "SIGHUP": DriverFault(STOPPED, refuse=_signalled("SIGHUP")),
}
_OF_MOTION: dict[str, DriverFault] = {
    "arm stuck": DriverFault(frozenset({K.NOT_FOLLOWING}), move=_stuck(np.inf)),
    "arm stuck for a while": DriverFault(GOES_ON, move=_stuck(0.4)),
}
DRIVER_FAULTS = {**_OF_SAMPLES, **_OF_STEPS, **_OF_MOTION}
