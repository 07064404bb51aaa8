"""The study of features: servoings arrive, checks fail where they have to, ViSP is asked."""

from pathlib import Path

import numpy as np
import pytest

from vergence.errors import VergenceError
from vergence.studies.features.matrices import matrix_errors
from vergence.studies.features.scene import KINDS, Start, arm, compared, draw_start, seen
from vergence.studies.features.servo import Servoing, servo
from vergence.studies.features.study import AVOIDANCE, FREE, OURS, VISP, checks_of
from vergence.studies.features.study import visp as features_visp
from vergence.studies.ideal_loop import Ending

START = draw_start(3, 0)


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_arrives_at_its_goal_free_and_on_the_arm(kind: str) -> None:
    for on_arm in (False, True):
        went = servo(kind, START, on_arm)
        assert went.ending is Ending.ARRIVED
        if kind != "ellipse":  # which leaves the turn about the circle's axis free
            assert went.path_m > 0.99 * START.straight_m
        assert not went.too_fast


@pytest.mark.parametrize("number", [5, 8, 21, 43])
def test_moments_arrive_from_starts_at_which_six_values_end_at_another_tilt(number: int) -> None:
    assert servo("moments", draw_start(0, number), on_arm=False).ending is Ending.ARRIVED


def test_a_start_is_drawn_the_same_again_and_shows_the_target_at_both_ends() -> None:
    again = draw_start(3, 0)
    np.testing.assert_array_equal(again.q, START.q)
    np.testing.assert_array_equal(again.T_goal_target, START.T_goal_target)
    assert not arm().outside(START.q).any()
    for kind in KINDS:
        assert seen(kind, START.T_camera_target) is not None
        assert seen(kind, START.T_goal_target) is not None


def test_a_target_seen_from_behind_is_not_seen() -> None:
    turned = START.T_camera_target.copy()
    turned[:3, 1:3] *= -1.0
    assert seen("points", turned) is None


def test_points_of_an_ellipse_are_compared_whichever_of_it_are_given() -> None:
    around = seen("ellipse", START.T_camera_target)
    assert around is not None
    np.testing.assert_allclose(
        compared("ellipse", np.roll(around.points, 5, axis=0)), compared("ellipse", around.points)
    )


def test_matrices_are_those_of_differences() -> None:
    errors = matrix_errors(3, 0)
    assert len(errors) >= 14
    assert max(errors.values()) < 1e-6


def rows(ending: Ending, count: int = 10, bad: int = 0) -> list[Servoing]:
    return [Servoing(ending, 1.0, 0.5)] * (count - bad) + [Servoing(Ending.SHORT, 1.0, 0.5)] * bad


def found(bad: int = 0, visp_bad: int | None = None) -> dict[tuple[str, str, str], list[Servoing]]:
    made = {
        (OURS, plant, kind): rows(Ending.ARRIVED, bad=bad)
        for plant in (FREE, "arm")
        for kind in KINDS
    }
    if visp_bad is not None:
        for plant in (FREE, "arm", AVOIDANCE):
            made |= {(VISP, plant, kind): rows(Ending.ARRIVED, bad=visp_bad) for kind in KINDS}
    return made


def by_name(made: dict[tuple[str, str, str], list[Servoing]], version: str, error: float = 0.0):
    starts: list[Start] = [START] * 10
    return {check.name: check for check in checks_of({"points": error}, starts, made, version)}


def test_checks_hold_and_fail_by_what_was_found() -> None:
    assert all(check.holds for check in by_name(found(1), "").values())
    assert not by_name(found(), "", error=1e-5)["features.matrix_error_max"].holds
    assert not by_name(found(2), "")["features.converged.lines"].holds
    assert not by_name(found(1, 0), "ViSP 3.5.0")["features.converged.lines"].holds
    assert not by_name(found(1, 0), "ViSP 3.5.0")["features.free.lines"].holds
    passed = found()
    passed[OURS, "arm", "points"] = rows(Ending.JOINT)
    assert not by_name(passed, "")["features.limits_passed"].holds
    passed[OURS, "arm", "lines"] = rows(Ending.VIEW)
    assert not by_name(passed, "")["features.left_view"].holds
    passed[OURS, "arm", "points"] = [Servoing(Ending.ARRIVED, 1.0, 0.5, too_fast=True)] * 10
    assert by_name(passed, "")["features.limits_passed"].measured == 10


def test_without_visp_nothing_is_claimed_about_it_which_is_said_once() -> None:
    first, *others = by_name(found(), "").values()
    assert "Not compared with ViSP" in first.note
    assert "apt-get install libvisp-dev g++" in first.note
    for check in others:
        assert "ViSP" not in check.note + check.paper
    for name, check in by_name(found(0, 0), "ViSP 3.5.0").items():
        if name.startswith(("features.converged", "features.free")):
            assert "no fewer than ViSP" in check.paper


def programs(folder: Path, compiler: str) -> None:
    """Write a visp-config and a g++ that are found before any others."""
    for name, script in (("visp-config", "echo -I/nowhere"), ("g++", compiler)):
        (folder / name).write_text(f"#!/bin/sh\n{script}\n")
        (folder / name).chmod(0o755)


def test_visp_is_compiled_and_asked_in_plain_words(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PATH", str(tmp_path), prepend=":")
    answers = "ViSP 0\\narrived 2.5 0.75\\nview 1 0.1\\n"
    program = tmp_path / "program"
    program.write_text(f"#!/bin/sh\ncat > {tmp_path}/told\nprintf '{answers}'\n")
    program.chmod(0o755)
    programs(tmp_path, f'cp {program} "$5"')
    assert features_visp.installed()
    asked = [features_visp.Asked(kind, "arm", START) for kind in ("points", "2.5d")]
    version, went = features_visp.servo_with_visp(asked)
    assert version == "ViSP 0"
    assert went == [Servoing(Ending.ARRIVED, 2.5, 0.75), Servoing(Ending.VIEW, 1.0, 0.1)]
    n = arm().joint_count
    words = (tmp_path / "told").read_text().split()
    assert words.count("2.5d") == 1
    setup = 9 + 1 + 12 + 3 + 1 + 12 * (n + 1) + 4 * n
    assert len(words) == setup + 1 + 2 * (2 + 12 + 12 + n)
    assert words[setup : setup + 3] == ["2", "points", "arm"]


def test_a_compiler_that_fails_is_named_with_its_last_words(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PATH", str(tmp_path), prepend=":")
    programs(tmp_path, "echo 'no such header' >&2; exit 1")
    with pytest.raises(VergenceError, match=r"g\+\+ failed: no such header"):
        features_visp.servo_with_visp([])
