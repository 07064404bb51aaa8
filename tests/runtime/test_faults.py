"""Whatever a driver or a law does, a run ends by name and every set-point is inside the limits."""

import logging
from collections.abc import Iterator

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scripted_cell import Notes, ScriptedDriver, looped

from vergence.robot import Arm, Chain
from vergence.runtime import Timeouts
from vergence.signals import Outcome, OutcomeKind, Setpoint
from vergence.studies.guarantees.driver_faults import DRIVER_FAULTS
from vergence.studies.guarantees.faults import keeps_limits
from vergence.studies.guarantees.faulty_driver import FaultyDriver
from vergence.studies.guarantees.law_faults import LAW_FAULTS, FaultyLaw

TIMEOUTS = Timeouts(robot_s=0.6)


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
    driver = FaultyDriver(ScriptedDriver(), DRIVER_FAULTS[fault])
    outcome = outcome_of(driver, FaultyLaw(np.array([0.3, -0.2])))
    assert outcome.kind in DRIVER_FAULTS[fault].ends
    assert keeps_limits(driver, not DRIVER_FAULTS[fault].deaf)
    assert max(abs(s["left"].velocity).max() for s in driver.handed) > 0.1


@pytest.mark.parametrize("fault", DRIVER_FAULTS)
def test_a_driver_that_is_faulty_from_the_start_never_moves_its_arm_unchecked(fault: str) -> None:
    driver = FaultyDriver(ScriptedDriver(), DRIVER_FAULTS[fault], at=0.0)
    outcome = outcome_of(driver, FaultyLaw(np.array([0.3, -0.2])))
    assert isinstance(outcome.kind, OutcomeKind)
    assert keeps_limits(driver, not DRIVER_FAULTS[fault].deaf)


@pytest.mark.parametrize("fault", LAW_FAULTS)
def test_a_fault_of_the_law_ends_by_name_with_the_arm_braked(fault: str) -> None:
    driver = FaultyDriver(ScriptedDriver())
    outcome = outcome_of(driver, FaultyLaw(np.array([0.3, -0.2]), LAW_FAULTS[fault]))
    assert outcome.kind in LAW_FAULTS[fault].ends
    assert keeps_limits(driver)


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
    scripted = ScriptedDriver(
        arms={"left": arm},
        inner_rate_hz=float(rng.choice([125.0, 500.0, 1000.0])),
        camera_rate_hz=float(rng.choice([25.0, 30.0, 60.0])),
        latency_s=float(rng.choice([0.0, 0.004, 0.05])),
    )
    driver = FaultyDriver(scripted, DRIVER_FAULTS[fault], rng.uniform(0.0, 0.6), rng)
    law = FaultyLaw(slow_rates(arm), LAW_FAULTS[law_fault], rng.uniform(0.0, 0.6), rng)
    outcome = outcome_of(driver, law, 1.0)
    assert isinstance(outcome.kind, OutcomeKind)
    assert keeps_limits(driver, not DRIVER_FAULTS[fault].deaf)


@pytest.mark.parametrize(
    ("position", "velocity"),
    [
        ([0.0, 1.1], [0.0, 0.0]),  # outside its range
        ([0.0, 0.0], [0.0, 2.1]),  # too fast
        ([0.0, 0.0], [0.1, 0.0]),  # from rest in one tick
        ([np.nan, 0.0], [0.0, 0.0]),
    ],
)
def test_a_set_point_past_a_limit_is_noticed(position, velocity) -> None:
    driver = FaultyDriver(ScriptedDriver())
    others = Setpoint(np.zeros(3), np.zeros(3))
    driver.step({"left": Setpoint(np.zeros(2), np.zeros(2)), "right": others})
    assert keeps_limits(driver)
    driver.step({"left": Setpoint(np.array(position), np.array(velocity)), "right": others})
    assert not keeps_limits(driver, to_rest=False)


def test_there_are_enough_faults() -> None:
    assert len(DRIVER_FAULTS) >= 40
    assert len(LAW_FAULTS) >= 30


def test_an_arm_that_is_stuck_until_the_time_is_over_does_not_complete() -> None:
    for duration_s in (1.0, 1.05, 1.1):
        driver = FaultyDriver(ScriptedDriver(), DRIVER_FAULTS["arm stuck"])
        outcome = looped(driver, law=FaultyLaw(np.array([0.5, -0.2]))).run(duration_s)
        assert outcome.kind is OutcomeKind.NOT_FOLLOWING


@pytest.mark.parametrize("fault", ["arm stuck for a while", "stopped for a while"])
@pytest.mark.parametrize("seed", range(4))
def test_an_arm_that_is_released_continues_from_where_it_is(fault: str, seed: int) -> None:
    rng = np.random.default_rng(seed)
    driver = FaultyDriver(ScriptedDriver(), DRIVER_FAULTS[fault], rng.uniform(0.2, 0.5), rng)
    notes = Notes()
    loop = looped(driver, law=FaultyLaw(np.array([0.5, -0.4])), listeners=[notes])
    assert loop.run(1.6).succeeded
    assert keeps_limits(driver)
    names = [name for _, name, _ in notes.events]
    released = notes.events[names.index("following")][0]
    assert names[0] in ("not following", "protective stop")
    states = {record.time: record for record in notes.ticks}
    first = min(time for time in states if time >= released)
    gap = states[first].setpoints["left"].position - states[first].sample.joints["left"].position
    assert np.abs(gap).max() < 0.02  # within half of the bound
    went = [states[time].sample.joints["left"].position for time in (first, max(states))]
    assert np.abs(went[1] - went[0]).max() > 0.05
