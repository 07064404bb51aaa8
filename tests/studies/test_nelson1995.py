"""The first paper's checks on exact projections, and that they can fail."""

from types import SimpleNamespace

import numpy as np
import pytest

from vergence.cell import load_cell
from vergence.studies import nelson1995
from vergence.studies.check import bisect_threshold, within
from vergence.studies.nelson1995 import limits, runs


@pytest.fixture(scope="module")
def result(tmp_path_factory):
    told = []
    out = tmp_path_factory.mktemp("figures")
    study = nelson1995.reproduce(out, True, lambda what, share: told.append(share))
    return SimpleNamespace(study=study, told=told)


def test_every_claim_of_the_paper_holds(result):
    assert [check.name for check in result.study.checks if not check.holds] == []
    assert result.study.holds


def test_every_check_of_the_paper_is_there(result):
    names = {check.name.split(".")[0] for check in result.study.checks}
    assert names == {
        *("two_axis", "four_axis", "avoidance", "figure15", "misprint", "stability", "headings"),
        "speed",
    }
    assert all(np.isfinite(check.measured) for check in result.study.checks)


def test_figures_are_written_in_the_papers_order(result):
    names = [figure.path.name for figure in result.study.figures]
    assert names == sorted(names)
    assert len(names) == 10
    assert all(figure.path.stat().st_size > 1000 for figure in result.study.figures)


def test_progress_only_goes_forward(result):
    assert result.told == sorted(result.told)
    assert result.told[-1] <= 1.0


def measured(result, name):
    return next(check.measured for check in result.study.checks if check.name == name)


def test_without_avoidance_only_the_ratio_of_Q_and_R_counts(result):
    """S = 0: u = -(BᵀQB + R)⁻¹BᵀQe is the same for kQ and R as for Q and R/k."""
    factor, least = (
        measured(result, f"stability.{name}") for name in ("q_factor_unstable", "r_unstable")
    )
    assert factor * least == pytest.approx(10.0, rel=0.03)


def test_two_axes_lag_by_as_much_more_as_their_gain_is_lower(result):
    """A ramp of v px an image lags by v/g, g = a/(R + a) with a = Q B Bᵀ, [Nelson1995] eq. (17)."""
    cell = load_cell("puma560")
    camera = runs.run(cell.replace(duration_s=0.2), True).run.cameras["wrist"]
    focal, depth = 16.0 / 0.011, float(camera.true_depth_m[0, 0])
    two, four = 2e-6 * (focal / depth) ** 2, 2e-6 * focal**2 * (1 + 1 / depth**2)
    ratio = (four / (10.0 + four)) / (two / (10.0 + two))
    assert measured(result, "figure15.two_over_four_axis_error") == pytest.approx(ratio, rel=0.03)


def test_a_strategy_that_does_not_track_fails_its_checks(monkeypatch):
    monkeypatch.setattr(limits, "moving", lambda cell, *_, **__: cell.replace(duration_s=0.5))
    check = limits.misprint(load_cell("puma560"), True)
    assert not check.holds


def test_thresholds_are_bracketed():
    assert bisect_threshold(lambda x: x <= 3.0, 1.0, 10.0, 0.01) == pytest.approx(3.0, rel=0.011)
    assert bisect_threshold(lambda x: True, 1.0, 10.0, 0.01) == 10.0
    assert np.isnan(bisect_threshold(lambda x: False, 1.0, 10.0, 0.01))


def test_nothing_measured_is_nothing_held():
    assert not within(float("nan"), 0.0, 1.0)
