"""The study of photographs: what counts as reached wrongly, and what trials are made of."""

from pathlib import Path

import numpy as np
import pytest

from vergence.signals import OutcomeKind
from vergence.studies.photograph.methods import Method
from vergence.studies.photograph.study import checks_of, result_of
from vergence.studies.photograph.trials import SCENES, Trial, TrialResult

REACHED, REFUSED = OutcomeKind.REACHED, OutcomeKind.INFEASIBLE


def ended(kind=REACHED, mm=0.1, deg=0.01, feasible=True, moved=True, reason="so"):
    trial = Trial.drawn(0, 0)
    return TrialResult(trial, kind, reason, feasible, moved, 0.1, 20.0, 1e-3 * mm, deg, 5.0)


def holds(results):
    return {check.name.split(".")[1]: check.holds for check in checks_of(results)}


def test_reached_is_held_against_where_the_camera_truly_is() -> None:
    assert all(holds([ended()] * 20).values())
    assert not holds([ended()] * 20 + [ended(mm=1.5)])["reached_wrongly"]
    assert not holds([ended()] * 20 + [ended(deg=0.3)])["reached_wrongly"]
    assert not holds([ended()] * 20 + [ended(mm=4.0)])["worst_mm"]


def test_one_of_twenty_feasible_starts_not_reached_is_too_many_and_others_do_not_count() -> None:
    lost = ended(OutcomeKind.NOT_REACHED, mm=50.0)
    assert not holds([ended()] * 19 + [lost])["reached"]
    assert holds([ended()] * 20 + [lost._replace(feasible=False)] * 5)["reached"]


def test_a_refusal_has_to_say_why() -> None:
    silent = ended(REFUSED, mm=100.0, moved=False, feasible=False, reason="")
    assert not holds([ended()] * 20 + [silent])["refused"]


def test_a_method_that_arrives_more_often_than_vergence_is_shown(tmp_path: Path) -> None:
    other = [ended(mm=30.0), ended()]
    found = dict.fromkeys(Method, other)
    assert result_of(found, tmp_path, 0).checks[-1].holds
    found[Method.WITHOUT_PLAN] = [ended(), ended()]
    result = result_of(found, tmp_path, 0)
    assert [check.holds for check in result.checks[-2:]] == [True, False]
    assert [figure.path.stem for figure in result.figures] == ["errors", "methods"]


def test_trials_are_the_same_for_the_same_seed_and_cover_every_scene() -> None:
    trials = [Trial.drawn(0, number) for number in range(60)]
    assert repr(trials) == repr([Trial.drawn(0, number) for number in range(60)])
    assert {trial.scene for trial in trials} == set(SCENES)
    assert 0.3 < np.mean([trial.hidden for trial in trials]) < 0.7
    assert any(trial.other_camera for trial in trials)
    assert trials[0].goal_deg == pytest.approx(trials[1].goal_deg)  # one photograph, two starts
    assert trials[0].start_deg != pytest.approx(trials[1].start_deg)
