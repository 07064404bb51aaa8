"""With a fixed camera, a held object is brought to its desired place in the image."""

import numpy as np
import pytest

from vergence.assembly import run_cell
from vergence.cell import load_cell
from vergence.errors import InputError
from vergence.runtime import Recorder, Recording


@pytest.mark.parametrize(
    "law",
    [
        {},
        {"gain": 2.0, "solver": "pseudo_inverse", "feed_forward": False},
        {"kind": "optimal_tracking", "R": 0.01, "Q": 8e-6},
    ],
)
def test_every_law_for_a_camera_in_the_hand_serves_a_fixed_one(law):
    result = run_cell(load_cell("eye_to_hand").replace(law=law), images=False)
    assert result.outcome.succeeded
    assert result.summary["max_error_px"] > 200
    assert result.summary["final_error_px"] < 2.0


def test_it_works_through_rendered_images():
    result = run_cell(load_cell("eye_to_hand").replace(duration_s=4.0))
    assert result.outcome.succeeded
    assert result.summary["final_error_px"] < 0.5
    assert result.summary["max_drift_px"] < 0.5


def test_by_pose_two_cameras_bring_a_block_to_its_place_through_rendered_images():
    result = run_cell(load_cell("eye_to_hand_pose").replace(duration_s=4.0))
    assert result.outcome.succeeded
    assert result.summary["max_pose_error_m"] > 0.25
    assert result.summary["max_pose_error_deg"] > 30.0
    assert result.summary["final_pose_error_m"] < 1e-3
    assert result.summary["final_pose_error_deg"] < 0.3


def test_by_pose_it_matters_not_where_the_only_camera_is_believed_to_stand():
    """Where the target is and where it should be are seen by the same camera."""
    off = {"calibration_error_m": 0.02, "calibration_error_deg": 1.0}
    cell = load_cell("eye_to_hand_pose").replace(
        duration_s=8.0, perception={"cameras": ["front"]}, cameras={"front": off}
    )
    result = run_cell(cell, images=False)
    assert result.outcome.succeeded
    assert result.summary["max_target_error_m"] > 0.01
    assert result.summary["final_pose_error_m"] < 2e-3
    assert result.summary["final_pose_error_deg"] < 0.5


def test_by_pose_the_constrained_law_gets_there_too():
    law = {"kind": "position_based", "filter_hz": 0.4, "solver": "quadratic_program"}
    result = run_cell(load_cell("eye_to_hand_pose").replace(law=law), images=False)
    assert result.outcome.succeeded
    assert result.summary["final_pose_error_m"] < 1e-3
    assert result.summary["final_pose_error_deg"] < 0.3


def test_the_recording_says_where_the_corners_are_desired_and_that_they_got_there(tmp_path):
    recorder = Recorder(tmp_path)
    run_cell(load_cell("eye_to_hand_pose").replace(duration_s=4.0), [recorder], images=False)
    trace = Recording.open(tmp_path).cameras["front"]
    off = np.linalg.norm(trace.desired_px - trace.true_px, axis=-1)
    assert np.nanmax(off[0]) > 50.0
    assert np.nanmax(off[-1]) < 2.0
    assert np.isfinite(trace.T_camera_target_desired).all()


def test_a_camera_that_moves_with_the_target_is_refused():
    with pytest.raises(InputError, match=r"task\.camera.*does not move with it"):
        load_cell("eye_to_hand_pose").replace(cameras={"front": {"arm": "puma"}})


def test_a_fixed_camera_and_a_target_that_nobody_carries_are_refused():
    with pytest.raises(InputError, match=r"task\.camera.*target\.carried_by = 'puma'"):
        load_cell("eye_to_hand").replace(target={"carried_by": None})
