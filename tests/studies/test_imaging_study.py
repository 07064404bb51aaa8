"""The study of imaging: what its checks and its table say of runs, and one run itself."""

import csv
from math import isnan
from pathlib import Path

import pytest

from vergence.studies.imaging.cases import CASES, Case, Measured, Trial, measure
from vergence.studies.imaging.study import Row, check_of, write_table

CASE = Case("tracker", "points", Trial("ur5"))


def row(ideal: list[Measured], real: list[Measured]) -> Row:
    return Row(CASE, ideal, real)


GOOD, WORSE, LOST = Measured(False, 0.2, 0.1), Measured(False, 0.5, 0.4), Measured(True, 9.0, 9.0)


def test_a_little_worse_holds_and_much_worse_does_not() -> None:
    assert check_of(row([GOOD] * 3, [WORSE] * 3)).holds
    much = check_of(row([GOOD] * 3, [Measured(False, 1.2, 0.4)] * 3))
    assert not much.holds
    assert much.measured == pytest.approx(1.2)


def test_one_lost_run_breaks_the_check_and_is_left_out_of_the_errors() -> None:
    check = check_of(row([GOOD] * 3, [WORSE, LOST, WORSE]))
    assert not check.holds
    assert check.measured == pytest.approx(0.5)
    assert "lost 1 of 3" in check.note
    nothing = check_of(row([GOOD] * 3, [LOST] * 3))
    assert isnan(nothing.measured)
    assert not nothing.holds


def test_the_table_has_a_line_for_each_case(tmp_path: Path) -> None:
    write_table(tmp_path / "imaging.csv", [row([GOOD], [LOST]), row([GOOD], [WORSE])])
    with (tmp_path / "imaging.csv").open(encoding="utf-8", newline="") as file:
        lines = list(csv.DictReader(file))
    assert [(line["final_ideal"], line["final_real"]) for line in lines] == [
        ("0.2", "nan"),
        ("0.2", "0.5"),
    ]
    assert [line["lost_real"] for line in lines] == ["1", "0"]


def test_each_case_has_a_name_of_its_own() -> None:
    assert len({(case.role, case.name) for case in CASES}) == len(CASES)


def test_a_run_is_measured_against_the_truth() -> None:
    measured = measure(Trial("puma560", duration_s=0.4), "real_camera", 0)
    assert not measured.lost
    assert 0.0 < measured.tracking < 1.0
    assert measured.final > 0.0
