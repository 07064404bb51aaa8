"""A camera on a stand brings what the hand holds to where it is wanted in its picture."""

import pytest

from vergence.cell import load_cell
from vergence.errors import InputError
from vergence.runtime import run_cell


@pytest.mark.parametrize(
    "law",
    [
        {},
        {"kind": "plain", "gain": 2.0},
        {"kind": "constrained", "objective": "optimal_tracking", "R": 0.01},
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


def test_a_fixed_camera_and_a_target_that_nobody_carries_are_refused():
    with pytest.raises(InputError, match=r"task\.camera.*target\.carried_by = 'puma'"):
        load_cell("eye_to_hand").replace(target={"carried_by": None})
