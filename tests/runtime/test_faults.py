"""Whatever a driver or a law does, a run ends by name and every set-point is inside the limits."""

import logging
from collections.abc import Iterator

import numpy as np
import pytest
from faults import DRIVER_FAULTS, LAW_FAULTS, FaultyDriver, FaultyLaw
from hypothesis import given, settings
from hypothesis import strategies as st
from scripted_cell import Notes, looped

from vergence.robot import Arm, Chain
from vergence.runtime import Timeouts
from vergence.signals import Outcome, OutcomeKind

ROUNDING = 1e-9
TIMEOUTS = Timeouts(robot_s=0.6)
UNREACHABLE = {"step raises OSError", "step raises ValueError", "step raises DriverSilent"}


@pytest.fixture(autouse=True)
def _no_log() -> Iterator[None]:
    logging.disable(logging.CRITICAL)
    yield
    logging.disable(logging.NOTSET)


def drawn_arm(rng: np.random.Generator) -> Arm:
    n = int(rng.integers(1, 8))
    chain = Chain(
        np.tile(np.eye(3), (n + 1, 1, 1)), np.zeros((n + 1, 3)), np.zeros(n, dtype=np.bool_)
    )
    half = rng.uniform(0.5, 3.0, n)
    names = tuple(f"joint{i + 1}" for i in range(n))
    return Arm(names, chain, -half, half, rng.uniform(0.5, 3, n), 10 ** rng.uniform(0.5, 1.5, n))


def assert_safe(driver: FaultyDriver, reaches_rest: bool) -> None:
    """Check every set-point that was handed over, until rest."""
    dt = 1.0 / driver.inner_rate_hz
    if not driver.handed:
        return
    for name, arm in driver.arms.items():
        position = np.array([setpoints[name].position for setpoints in driver.handed])
        velocity = np.array([setpoints[name].velocity for setpoints in driver.handed])
        assert np.isfinite(position).all()
        assert (position >= arm.q_min - ROUNDING).all()
        assert (position <= arm.q_max + ROUNDING).all()
        assert (abs(velocity) <= arm.rate_max * (1 + ROUNDING)).all()
        change = abs(np.diff(velocity, axis=0, prepend=np.zeros((1, arm.joint_count))))
        assert (change <= arm.acceleration_max * dt * (1 + ROUNDING) + ROUNDING).all()
        np.testing.assert_allclose(np.diff(position, axis=0), dt * velocity[1:], atol=1e-9)
        if reaches_rest:
            np.testing.assert_allclose(velocity[-1], 0.0, atol=1e-9)


def outcome_of(driver: FaultyDriver, law: FaultyLaw, duration_s: float = 1.5) -> Outcome:
    notes = Notes()
    outcome = looped(driver, law=law, listeners=[notes], timeouts=TIMEOUTS).run(duration_s)
    assert outcome.reason
    assert "\n" not in str(outcome)
    if not outcome.succeeded:
        assert notes.events[-1] == (outcome.time, outcome.kind.value, outcome.reason)
    return outcome


def slow_rates(arm: Arm) -> np.ndarray:
    return 0.2 * arm.q_max * np.resize([1.0, -1.0], arm.joint_count)


@pytest.mark.parametrize("fault", DRIVER_FAULTS)
def test_a_fault_of_the_driver_ends_by_name_with_the_arm_braked(fault: str) -> None:
    driver = FaultyDriver(fault=fault)
    outcome = outcome_of(driver, FaultyLaw(np.array([0.3, -0.2])))
    assert outcome.kind in DRIVER_FAULTS[fault]
    assert_safe(driver, fault not in UNREACHABLE)
    assert max(abs(s["left"].velocity).max() for s in driver.handed) > 0.1


@pytest.mark.parametrize("fault", DRIVER_FAULTS)
def test_a_driver_that_is_faulty_from_the_start_never_moves_its_arm_unchecked(fault: str) -> None:
    driver = FaultyDriver(fault=fault, at=0.0)
    outcome = outcome_of(driver, FaultyLaw(np.array([0.3, -0.2])))
    assert isinstance(outcome.kind, OutcomeKind)
    assert_safe(driver, fault not in UNREACHABLE)


@pytest.mark.parametrize("fault", LAW_FAULTS)
def test_a_fault_of_the_law_ends_by_name_with_the_arm_braked(fault: str) -> None:
    driver = FaultyDriver()
    outcome = outcome_of(driver, FaultyLaw(np.array([0.3, -0.2]), fault))
    assert outcome.kind in LAW_FAULTS[fault][0]
    assert_safe(driver, True)


@settings(max_examples=40, deadline=None)
@given(
    st.sampled_from(sorted(DRIVER_FAULTS)),
    st.sampled_from(sorted(LAW_FAULTS)),
    st.integers(0, 2**32 - 1),
)
def test_any_two_faults_on_any_arm_end_by_name_inside_the_limits(
    fault: str, law_fault: str, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    arm = drawn_arm(rng)
    driver = FaultyDriver(
        fault=fault,
        at=rng.uniform(0.0, 0.6),
        rng=rng,
        arms={"left": arm},
        inner_rate_hz=float(rng.choice([125.0, 500.0, 1000.0])),
        camera_rate_hz=float(rng.choice([25.0, 30.0, 60.0])),
        latency_s=float(rng.choice([0.0, 0.004, 0.05])),
    )
    law = FaultyLaw(slow_rates(arm), law_fault, at=rng.uniform(0.0, 0.6), rng=rng)
    outcome = outcome_of(driver, law, 1.0)
    assert isinstance(outcome.kind, OutcomeKind)
    assert_safe(driver, fault not in UNREACHABLE)


def test_there_are_enough_faults() -> None:
    assert len(DRIVER_FAULTS) >= 40
    assert len(LAW_FAULTS) >= 30
