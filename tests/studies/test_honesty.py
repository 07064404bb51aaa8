"""The study of honesty: what counts as wrong, and scenes of every part."""

from importlib import import_module

import numpy as np
import pytest

from vergence.studies.honesty.answer import UNFOUNDED, Answer, deviations_of, refused
from vergence.studies.honesty.study import SCENES, checks_of


def test_deviations_of_one_number_are_its_own_and_of_several_are_as_unlikely() -> None:
    assert deviations_of(np.array([0.3]), np.array([[0.01]])) == pytest.approx(3.0)
    # 95 % of pairs of numbers lie within √5.991 of their deviations.
    error = np.array([np.sqrt(5.991), 0.0])
    assert deviations_of(error, np.eye(2)) == pytest.approx(1.96, abs=1e-3)
    assert deviations_of(error, -np.eye(2)) == UNFOUNDED
    assert deviations_of(error, np.diag([1.0, 0.0])) == UNFOUNDED


def test_answers_beyond_five_deviations_and_refusals_without_a_reason_fail() -> None:
    right = [Answer("a", 1.0, 1)] * 999
    named = {check.name: check for check in checks_of([*right, Answer("a", 6.0, 1)], 1000)}
    assert named["honesty.wrong_per_1000"].measured == pytest.approx(1.0)
    assert named["honesty.wrong_per_1000"].holds
    worse = checks_of([*right, *[Answer("b", UNFOUNDED, 2)] * 2], 1001)
    assert [check.holds for check in worse][:2] == [False, True]
    assert not checks_of([refused("a", "")], 1)[2].holds
    assert checks_of([refused("a", "dark")], 1)[1].note == "no answers: all refused"
    assert not named["a.coverage_3sigma"].note


@pytest.mark.parametrize("part", SCENES)
def test_scenes_are_answered_the_same_way_for_the_same_seed(part: str) -> None:
    module = import_module(f"vergence.studies.honesty.{part}")
    for number in range(len(module.KINDS)):
        answers = [module.try_scene(np.random.default_rng(number), number) for _ in range(2)]
        assert repr(answers[0]) == repr(answers[1])
        assert answers[0]
        assert all(a.kind.endswith(module.KINDS[number]) for a in answers[0])


@pytest.mark.parametrize("number", [53, 141, 153, 229, 325, 645, 785])
def test_points_whose_marks_hide_a_turn_or_have_twins_are_within_five_deviations(
    number: int,
) -> None:
    random = np.random.default_rng([0, list(SCENES).index("points"), number])
    answers = import_module("vergence.studies.honesty.points").try_scene(random, number)
    assert len(answers) == 5
    assert all(answer.deviations <= 5.0 for answer in answers if answer.explanations)
