"""Reaching an image taken beforehand: planned and tracked, or refused before anything moves."""

from dataclasses import replace

import numpy as np
import pytest

from vergence.assembly import run_cell
from vergence.assembly.tasks import reach
from vergence.cell import load_cell
from vergence.errors import InputError
from vergence.signals import OutcomeKind
from vergence.vision.two_view import estimate_two_view


def test_the_gantry_gets_where_the_image_was_taken_and_keeps_the_marks_in_view():
    result = run_cell(load_cell("gantry"), images=False)
    assert result.outcome.succeeded
    assert result.summary["final_error_px"] < 0.05
    assert result.summary["max_error_px"] < 5.0


def test_both_planners_reach_the_goal():
    cell = load_cell("gantry").replace(task={"planner": "potential_field", "camera_speed_m_s": 0.6})
    result = run_cell(cell, images=False)
    assert result.outcome.succeeded
    assert result.summary["final_error_px"] < 0.05


def test_rendered_marks_lead_there_too():
    cell = load_cell("gantry").replace(task={"camera_speed_m_s": 0.6})
    result = run_cell(cell)
    assert result.outcome.succeeded
    assert result.summary["max_error_px"] < 5.0
    assert result.summary["max_drift_px"] < 0.6


def test_a_mark_that_two_views_leave_out_is_left_out_of_the_way(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def leaves_one_out(*arguments):
        view = estimate_two_view(*arguments)
        return replace(view, inliers=view.inliers & (np.arange(len(view.inliers)) != 2))

    monkeypatch.setattr(reach, "estimate_two_view", leaves_one_out)
    cell = load_cell("gantry").replace(task={"camera_speed_m_s": 0.6})
    run = run_cell(cell, images=False)
    assert run.outcome.kind is OutcomeKind.REACHED
    assert (np.isfinite(run.cameras["eye"].error_px).sum(axis=1) == 8).all()  # of nine marks


def test_a_way_that_takes_too_long_is_an_outcome_before_anything_moves():
    result = run_cell(load_cell("gantry").replace(duration_s=3.0), images=False)
    assert result.outcome.kind is OutcomeKind.INFEASIBLE
    assert "duration_s leaves 3 s" in result.outcome.reason


def test_the_same_seed_gives_the_same_run():
    cell = load_cell("gantry").replace(task={"camera_speed_m_s": 0.6})
    first, second = (run_cell(cell, images=False).cameras["eye"] for _ in range(2))
    np.testing.assert_array_equal(first.T_world_camera, second.T_world_camera)


def test_no_translation_between_the_images_is_an_outcome_not_a_run():
    start = load_cell("gantry").arms["gantry"].start_deg
    cell = load_cell("gantry").replace(task={"goal_deg": start})
    result = run_cell(cell, images=False)
    assert result.outcome.kind is OutcomeKind.INFEASIBLE
    assert result.outcome.time == 0.0
    assert result.outcome.reason


def test_a_goal_from_which_the_marks_are_out_of_sight_is_an_outcome():
    cell = load_cell("gantry").replace(task={"goal_deg": [0.0, 0.0, 0.0, 0.0, 90.0, 0.0]})
    result = run_cell(cell, images=False)
    assert result.outcome.kind is OutcomeKind.INFEASIBLE
    assert "does not see mark" in result.outcome.reason


def test_a_goal_outside_the_joint_limits_is_refused_by_name():
    cell = load_cell("gantry").replace(task={"goal_deg": [9.0, 0.0, 0.0, 0.0, 0.0, 0.0]})
    with pytest.raises(InputError, match=r"task\.goal_deg\[0\].*joint1 between"):
        run_cell(cell, images=False)
