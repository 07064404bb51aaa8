"""Drivers and laws that misbehave: does every run end by name with the arm braked inside limits?"""

import logging
import signal
from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import numpy as np

from vergence.arrays import FloatArray
from vergence.camera import Camera
from vergence.experiments.workers import Workers
from vergence.planning import FixedReference
from vergence.robot import Arm
from vergence.runtime import Loop, Timeouts
from vergence.signals import Frame, ImagePoints, Observation, Outcome, OutcomeKind, Reference
from vergence.simulation import KinematicCell, KinematicDriver
from vergence.simulation.kinematic_driver import ARM, CAMERA
from vergence.studies.check import Check
from vergence.studies.guarantees.driver_faults import DRIVER_FAULTS
from vergence.studies.guarantees.faulty_driver import FaultyDriver
from vergence.studies.guarantees.law_faults import LAW_FAULTS, FaultyLaw
from vergence.studies.guarantees.runs import CELLS

FAULTS = (*DRIVER_FAULTS, *LAW_FAULTS)
BLIND_RUNS = 20  # for each arm
_RUN_S = 1.5
_CAMERA_HZ, _INNER_HZ = 30.0, 500.0
_TIMEOUTS = Timeouts(robot_s=0.6)
_SMALL = Camera(64, 48, 60.0, 60.0, 31.5, 23.5)
_POINTS_PX = np.array([[31.5, 23.5]])
_ROUNDING = 1e-9
_SIGNALS = {number.name: number for number in signal.Signals}


class FaultRun(NamedTuple):
    """What came of a run with a fault."""

    named: bool  # it ended as it may
    inside: bool  # every set-point, until rest, was inside position, rate and acceleration limits

    @property
    def good(self) -> bool:
        """Whether both hold."""
        return self.named and self.inside


def try_fault(arms: tuple[Arm, ...], seed: int, index: int) -> FaultRun:
    """Run one of `FAULTS` on one of the arms; the fault sets in at a moment at random.

    Args:
        arms: up to a camera.
        seed: names the set.
        index: of the fault and the arm.
    """
    name, arm = FAULTS[index // len(arms)], arms[index % len(arms)]
    rng = np.random.default_rng([seed, index, 11])
    at = rng.uniform(0.2, 0.6)
    fault, law_fault = DRIVER_FAULTS.get(name), LAW_FAULTS.get(name)
    driver = FaultyDriver(_ideal(arm, rng), fault, at, rng)
    law = FaultyLaw(_slow_rates(arm), law_fault, at, rng)
    outcome = _run(driver, law, _RUN_S)
    ends = fault.ends if fault is not None else LAW_FAULTS[name].ends
    if name in _SIGNALS and signal.getsignal(_SIGNALS[name]) is signal.SIG_IGN:
        ends = frozenset({OutcomeKind.COMPLETED})  # as in a job in the background
    return FaultRun(outcome.kind in ends, keeps_limits(driver, fault is None or not fault.deaf))


def keeps_limits(driver: FaultyDriver, to_rest: bool = True) -> bool:
    """Return whether every set-point that a driver was handed is inside all limits of its arm.

    Args:
        driver: with what it was handed.
        to_rest: whether the last one has to be at rest.
    """
    dt = 1.0 / driver.inner_rate_hz
    for name, arm in driver.arms.items() if driver.handed else ():
        q = np.array([setpoints[name].position for setpoints in driver.handed])
        rate = np.array([setpoints[name].velocity for setpoints in driver.handed])
        change = np.diff(rate, axis=0, prepend=np.zeros((1, arm.joint_count)))
        step = np.diff(q, axis=0) - dt * rate[1:]
        kept = (
            (q >= arm.q_min - _ROUNDING).all()
            and (q <= arm.q_max + _ROUNDING).all()
            and (np.abs(rate) <= arm.rate_max + _ROUNDING).all()
            and (np.abs(change) <= arm.acceleration_max * dt + _ROUNDING).all()
            and (np.abs(step) <= _ROUNDING).all()  # the rates are those of the positions
        )
        if not kept or (to_rest and np.abs(rate[-1]).max() > _ROUNDING):
            return False
    return True


def faults_check(
    arms: tuple[Arm, ...],
    seed: int,
    pool: Workers,
    progress: Callable[[float], None],
) -> Check:
    """Return the check: every fault on every arm ends by name, inside all limits until rest."""
    count = len(FAULTS) * len(arms)
    runs = pool.try_all(partial(try_fault, arms, seed), count, progress)
    bad = sorted({FAULTS[i // len(arms)] for i, run in enumerate(runs) if not run.good})
    return Check(
        "faults.named",
        "every fault ends in a named outcome, set-points inside all limits until rest: all",
        sum(run.good for run in runs),
        f"of {count} runs",
        not bad,
        f"{len(DRIVER_FAULTS)} faults of drivers and {len(LAW_FAULTS)} of laws, each on the arms "
        f"of {', '.join(CELLS)}; position, rate and acceleration limits"
        + (f"; not: {', '.join(bad)}" if bad else ""),
    )


def blind_check(arms: tuple[Arm, ...], seed: int) -> Check:
    """Return the check: how long an arm at full speed continues after its last image."""
    timeouts = Timeouts()
    travels, bounds = [], []
    for number, arm in enumerate(arms):
        braking_s = float((arm.rate_max / arm.acceleration_max).max())
        bounds.append(1.0 / _CAMERA_HZ + timeouts.decay_s + braking_s + 1.0 / _INNER_HZ)
        for run in range(BLIND_RUNS):
            rng = np.random.default_rng([seed, number, run, 12])
            travels.append(_blind_s(arm, rng) - bounds[-1])
    worst = max(range(len(travels)), key=travels.__getitem__)
    return Check(
        "blind.travel_s",
        "motion after the last image: at most a period, fading, and braking from full speed",
        travels[worst] + bounds[worst // BLIND_RUNS],
        "s",
        travels[worst] <= 0.0,
        f"longest motion after the last image; allowed there: {bounds[worst // BLIND_RUNS]:.3f} s",
    )


def _blind_s(arm: Arm, rng: np.random.Generator) -> float:
    """Return how long the set-points move after the last image, asked for full speed."""
    at = rng.uniform(0.3, 0.6)
    driver = FaultyDriver(_ideal(arm, rng), DRIVER_FAULTS["every image dropped"], at, rng)
    law = FaultyLaw(rng.choice([-1.0, 1.0], arm.joint_count) * arm.rate_max)
    _run(driver, law, at + 1.0)
    rates = np.array([setpoints[ARM].velocity for setpoints in driver.handed])
    moving = np.flatnonzero(np.abs(rates).max(axis=1) > _ROUNDING)
    images = np.arange(0.0, at, 1.0 / _CAMERA_HZ)
    return float((moving[-1] + 1) / _INNER_HZ - images[-1])


class _AlwaysFound:
    """Perception that finds its point in every image."""

    def observe(self, frames: tuple[Frame, ...]) -> Observation | None:
        if not frames:
            return None
        time, found = frames[-1].time, np.ones(1, dtype=np.bool_)
        view = ImagePoints(CAMERA, time, _POINTS_PX, np.eye(2)[None], found, ("",))
        return Observation(time, (view,))


def _run(driver: FaultyDriver, law: FaultyLaw, duration_s: float) -> Outcome:
    planner = FixedReference(Reference(0.0, _POINTS_PX))
    loop = Loop(
        driver, ARM, _AlwaysFound(), planner, law, outer_rate_hz=_CAMERA_HZ, timeouts=_TIMEOUTS
    )
    log = logging.getLogger(Loop.__module__)
    level = log.level
    log.setLevel(logging.CRITICAL)  # it would write a traceback of every fault
    try:
        return loop.run(duration_s)
    finally:
        log.setLevel(level)


def _ideal(arm: Arm, rng: np.random.Generator) -> KinematicDriver:
    """Return a driver of an arm that starts in the middle of its range."""
    low, high = _range(arm)
    start = low + rng.uniform(0.4, 0.6, arm.joint_count) * (high - low)
    return KinematicDriver(
        KinematicCell(
            arm,
            _SMALL,
            start,
            lambda times: np.tile(np.eye(4), (len(times), 1, 1)),
            np.zeros((1, 3)),
            rate_hz=_CAMERA_HZ,
            inner_rate_hz=_INNER_HZ,
        )
    )


def _slow_rates(arm: Arm) -> FloatArray:
    """Return rates at which a joint is far from its limits when a run is over."""
    low, high = _range(arm)
    signs = np.resize([1.0, -1.0], arm.joint_count)
    rates: FloatArray = signs * np.minimum(0.1 * (high - low), 0.5 * arm.rate_max)
    return rates


def _range(arm: Arm) -> tuple[FloatArray, FloatArray]:
    return np.maximum(arm.q_min, -np.pi), np.minimum(arm.q_max, np.pi)
