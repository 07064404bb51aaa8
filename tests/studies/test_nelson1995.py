"""The first paper's checks on exact projections, and that they can fail."""

from types import SimpleNamespace

import numpy as np
import pytest

from vergence.studies import nelson1995
from vergence.studies.check import bisect_threshold, within


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
    assert names == {"two_axis", "four_axis", "avoidance", "stability", "headings", "speed"}
    assert all(np.isfinite(check.measured) for check in result.study.checks)


def test_figures_are_written_in_the_papers_order(result):
    names = [figure.path.name for figure in result.study.figures]
    assert names == sorted(names)
    assert len(names) == 10
    assert all(figure.path.stat().st_size > 1000 for figure in result.study.figures)


def test_progress_only_goes_forward(result):
    assert result.told == sorted(result.told)
    assert result.told[-1] <= 1.0


def test_wrong_sign_of_the_first_entry_of_B_fails_the_checks(monkeypatch):
    """[Nelson1995] eq. (13) as printed: two-axis tracking cannot hold the feature."""
    from vergence.control import Servo

    right = Servo.command

    def mirrored(self, observation, reference, joints):
        command = right(self, observation, reference, joints)
        return type(command)(-command.velocity, -command.v_camera)

    monkeypatch.setattr(Servo, "command", mirrored)
    cell = nelson1995.load_cell("puma560").replace(law=nelson1995.STRATEGIES["two_axis"])
    trial = nelson1995.run(nelson1995.moving(cell, 1), True)
    assert not trial.outcome.succeeded
    assert trial.camera.time[-1] < 4.0


def test_thresholds_are_bracketed():
    assert bisect_threshold(lambda x: x <= 3.0, 1.0, 10.0, 0.01) == pytest.approx(3.0, rel=0.011)
    assert bisect_threshold(lambda x: True, 1.0, 10.0, 0.01) == 10.0
    assert np.isnan(bisect_threshold(lambda x: False, 1.0, 10.0, 0.01))


def test_nothing_measured_is_nothing_held():
    assert not within(float("nan"), 0.0, 1.0)
