"""No random run passes a limit, and a guard that lets go would be noticed."""

import signal

import numpy as np
import pytest

from vergence.control import guard
from vergence.runtime import loop
from vergence.signals import OutcomeKind, Setpoint
from vergence.studies.guarantees import study
from vergence.studies.guarantees.faults import FAULTS, blind_check, try_fault
from vergence.studies.guarantees.runs import LAWS, arms, attempt


@pytest.fixture(scope="module")
def known():
    return arms()


@pytest.mark.parametrize("first", range(0, 80, 20))
def test_random_runs_of_every_law_and_arm_pass_no_limit(known, first):
    for seed in range(first, first + 20):
        excess, outcome = attempt(known, seed).run(1.0)
        assert excess.position <= 0.0, (seed, outcome)
        assert excess.rate <= 1e-12, (seed, outcome)
        assert outcome.kind is not OutcomeKind.PART_RAISED, (seed, outcome)


def test_every_law_meets_every_arm(known):
    met = {(seed % len(known), attempt(known, seed).law) for seed in range(len(known) * len(LAWS))}
    assert len(met) == len(known) * len(LAWS)


def test_the_same_seed_is_the_same_run(known):
    assert attempt(known, 7).run(0.5) == attempt(known, 7).run(0.5)


def test_a_guard_that_lets_everything_through_is_noticed(known, monkeypatch):
    def open_guard(self, desired):
        self._position = self._position + self._dt * 5 * desired
        self._velocity = 5 * desired
        return Setpoint(self._position, self._velocity)

    monkeypatch.setattr(guard.Guard, "step", open_guard)
    monkeypatch.setattr(guard.Guard, "moving", property(lambda self: False))
    worst = [attempt(known, seed).run(0.5)[0] for seed in range(12)]
    assert max(excess.rate for excess in worst) > 0.0


def test_the_hard_cases_hold(known):
    puma = known[0]
    check, rows = study._singularity(puma)
    assert check.holds, check.note
    assert rows[:, 1].min() < 0.01
    for hard in (study._outside_start, study._conflict):
        assert hard(puma).holds, hard(puma).note


def test_a_heading_that_led_the_papers_law_to_a_limit_is_completed(known):
    assert study._follows(known[0], "constrained tracking", 0.1, np.pi / 2, 32.0)


def test_faults_on_the_arms_of_the_cells_end_by_name_inside_the_limits(known):
    for index in range(3, len(FAULTS) * len(known), 11):
        assert try_fault(known, 7, index).good, FAULTS[index // len(known)]


def test_ctrl_c_ends_a_run_by_name_in_a_worker_too_which_blocks_it(known):
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        assert try_fault(known, 7, FAULTS.index("SIGINT") * len(known)).good
        assert signal.SIGINT in signal.pthread_sigmask(signal.SIG_BLOCK, set())
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def test_faults_are_injected_without_tracebacks_on_the_screen(known, caplog):
    for _ in range(2):
        assert try_fault(known, 7, FAULTS.index("raises ValueError") * len(known)).good
    assert not caplog.records


def test_an_arm_continues_no_longer_than_stated_after_its_last_image(known, monkeypatch):
    assert blind_check(known[:1], 0).holds
    monkeypatch.setattr(loop, "command_share", lambda age_s, period_s, decay_s: 1.0)
    assert not blind_check(known[:1], 0).holds
