"""Whatever ends a run, the arm is braked within its limits, and the outcome says why."""

import json
import re
import resource
import signal
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from scripted_cell import Notes, ScriptedDriver, ScriptedEyes, ScriptedLaw, looped

from vergence.runtime import Recorder, Recording, RunInfo
from vergence.runtime.listeners import Listeners
from vergence.signals import Outcome, OutcomeKind

RATES = np.array([0.4, -0.4])


def assert_braked(driver: ScriptedDriver) -> None:
    velocities = driver.velocities()
    changes = np.diff(velocities, axis=0, prepend=np.zeros((1, 2)))
    assert (abs(velocities) > 0.3).any()
    assert (abs(changes) <= 8.0 * 2e-3 * (1 + 1e-9)).all()
    np.testing.assert_array_equal(velocities[-1], 0.0)


def failing(part: object, method: str, from_call: int, error: BaseException) -> object:
    """Let a method of a part raise from some call on."""
    calls, original = [0], getattr(part, method)

    def fail(*arguments):
        calls[0] += 1
        if calls[0] >= from_call:
            raise error
        return original(*arguments)

    setattr(part, method, fail)
    return part


@pytest.mark.parametrize("error", [ZeroDivisionError("division by zero"), KeyError("x"), OSError()])
@pytest.mark.parametrize("part", ["law", "perception", "driver"])
def test_what_a_part_raises_is_the_outcome_and_goes_to_the_log(part, error, caplog) -> None:
    driver, eyes, law = ScriptedDriver(), ScriptedEyes(), ScriptedLaw(RATES)
    method = {"law": (law, "command"), "perception": (eyes, "observe"), "driver": (driver, "read")}
    failing(*method[part], 300 if part == "driver" else 10, error)  # read once a tick
    outcome = looped(driver, eyes, law).run(5.0)
    assert outcome.kind is OutcomeKind.PART_RAISED
    assert f"the {part} raised {type(error).__name__}" in outcome.reason
    assert "\n" not in str(outcome)
    assert any(record.exc_info for record in caplog.records)
    assert_braked(driver)


def test_a_driver_that_refuses_one_set_point_is_still_braked() -> None:
    driver = ScriptedDriver()
    step = driver.step

    def refuse_one(setpoints) -> None:
        step(setpoints)
        if driver.tick == 300:
            raise OSError("once")

    driver.step = refuse_one
    outcome = looped(driver, law=ScriptedLaw(RATES)).run(5.0)
    assert outcome.kind is OutcomeKind.PART_RAISED
    assert_braked(driver)


def test_a_driver_that_refuses_every_set_point_is_named_and_left_to_its_watchdog() -> None:
    driver = ScriptedDriver()
    failing(driver, "step", 300, OSError("gone"))
    outcome = looped(driver, law=ScriptedLaw(RATES)).run(5.0)
    assert outcome.kind is OutcomeKind.PART_RAISED
    assert "not braked from here: the driver raised OSError: gone" in outcome.reason


def test_an_exit_from_inside_the_loop_brakes_the_arm_and_continues() -> None:
    driver, law = ScriptedDriver(), ScriptedLaw(RATES)
    failing(law, "command", 10, SystemExit(3))
    with pytest.raises(SystemExit):
        looped(driver, law=law).run(5.0)
    assert_braked(driver)


@pytest.mark.parametrize("method", ["tick", "event"])
def test_a_listener_that_fails_is_dropped_and_the_servoing_continues(method, caplog) -> None:
    driver, notes, bad = ScriptedDriver(), Notes(), Notes()
    failing(bad, method, 1, RuntimeError("the page is gone"))
    eyes = ScriptedEyes(hide_one=lambda exposed: "covered" if 0.5 < exposed < 0.8 else "")
    outcome = looped(driver, eyes, listeners=[bad, notes]).run(1.0)
    assert outcome.kind is OutcomeKind.COMPLETED
    told = [text for _, name, text in notes.events if name == "listener dropped"]
    (text,) = told
    assert re.match(r"Notes raised RuntimeError: the page is gone \(.*test_stopping.py:\d+\)", text)
    assert len(notes.ticks) == 30
    assert len(caplog.records) == 1


@pytest.mark.parametrize("name", ["SIGINT", "SIGTERM", "SIGHUP"])
def test_a_signal_brakes_the_arm(name: str) -> None:
    driver = ScriptedDriver()
    step, number = driver.step, getattr(signal, name)
    before = signal.getsignal(number)

    def signalled(setpoints) -> None:
        if driver.tick == 300:
            signal.raise_signal(number)
        step(setpoints)

    driver.step = signalled
    outcome = looped(driver, law=ScriptedLaw(RATES)).run(5.0)
    assert outcome.kind is OutcomeKind.STOPPED
    assert outcome.reason.endswith("the user" if name == "SIGINT" else name)
    assert signal.getsignal(number) is before
    assert_braked(driver)


def test_a_signal_that_the_process_ignores_stays_ignored() -> None:
    driver = ScriptedDriver()
    step = driver.step

    def signalled(setpoints) -> None:
        signal.raise_signal(signal.SIGHUP)
        step(setpoints)

    driver.step = signalled
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        assert looped(driver).run(0.2).kind is OutcomeKind.COMPLETED
    finally:
        signal.signal(signal.SIGHUP, before)


@pytest.fixture
def disk_of() -> Iterator[Callable[[int], None]]:
    """Let files grow to so many bytes; a write beyond that fails, as on a full disk."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    yield lambda size: resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    resource.setrlimit(resource.RLIMIT_FSIZE, before)


def recorded(folder: Path, driver: ScriptedDriver, notes: Notes) -> Outcome:
    recorder = Recorder(folder)
    listeners = Listeners([recorder, notes])
    listeners.begin(RunInfo.of(driver, "scripted", "", 0))
    outcome = looped(driver, law=ScriptedLaw(RATES), listeners=[recorder, notes]).run(2.5)
    listeners.close(outcome, {})
    return outcome


def test_a_full_disk_ends_neither_the_run_nor_what_was_recorded(tmp_path: Path, disk_of) -> None:
    recorded(tmp_path / "whole", ScriptedDriver(), Notes())
    whole = Recording.open(tmp_path / "whole")
    driver, notes = ScriptedDriver(), Notes()
    disk_of(int(0.55 * whole.path.stat().st_size))
    outcome = recorded(tmp_path / "cut", driver, notes)
    disk_of(resource.RLIM_INFINITY)
    assert outcome.kind is OutcomeKind.COMPLETED
    assert_braked(driver)
    assert "listener dropped" in [name for _, name, _ in notes.events]
    assert len(notes.ticks) == len(whole.arms["left"].time) == 75
    cut = Recording.open(tmp_path / "cut")
    assert len(cut.arms["left"].time) >= 30
    told = json.loads((tmp_path / "cut" / "summary.json").read_text())["outcome"]
    assert told["reason"] == outcome.reason
