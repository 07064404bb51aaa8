"""The cell `mug`: an object without corners is followed by its outline while the arm moves."""

import numpy as np
import pytest

import vergence as vg
from vergence.cell import load_cell
from vergence.errors import InputError
from vergence.estimation.known_object.object_follower import OUTLINE_RULE, ObjectFollower
from vergence.geometry import se3_exp
from vergence.studies.region.films import CAMERA, RATE_HZ
from vergence.studies.region.objects import OBJECTS
from vergence.vision.known_object import ObjectModel, SilhouetteTracker, as_followed


def test_a_mug_is_followed_and_found_again_where_it_was_seen_last() -> None:
    blind = {"wrist": {"blind_s": [[0.4, 0.9]]}}
    run = vg.run("mug", duration_s=2.5, cameras=blind, target={"motion": {"kind": "stationary"}})
    assert run.outcome.succeeded
    names = [event.name for event in run.events]
    assert names == ["target out of sight", "target in sight"]
    assert "of the outline" in run.events[0].text
    seen = ~((run.pose_errors.time >= 0.4) & (run.pose_errors.time < 1.0))
    assert np.linalg.norm(run.pose_errors.target_m, axis=-1)[seen].max() < 3e-3
    assert run.summary["final_pose_error_m"] < 3e-3


def test_a_mug_that_is_not_where_the_cell_says_is_refused_before_anything_moves() -> None:
    with pytest.raises(InputError, match=r"none of the cameras .wrist. sees it: .* of the outline"):
        vg.run("mug", duration_s=1.0, perception={"start_error_m": 0.06, "start_error_deg": 20.0})


def test_objects_are_followed_by_what_shows_them() -> None:
    mug = as_followed(ObjectModel.from_mesh("mug", *OBJECTS["mug"]()))
    assert len(mug.corners) == 8
    assert len(mug.triangles)
    places = np.array([[x, y, z] for x in (0, 0.1) for y in (0, 0.1) for z in (0, 0.1)])
    faces = [[0, 1, 3], [0, 3, 2], [4, 7, 5], [4, 6, 7], [0, 5, 1], [0, 4, 5],
             [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]]  # fmt: skip
    box = ObjectModel.from_mesh("box", places, faces)
    assert as_followed(box) is box


def test_a_motion_of_the_camera_and_back_changes_nothing_that_is_believed() -> None:
    tracker = SilhouetteTracker(ObjectModel.from_mesh("can", *OBJECTS["can"]()))
    T = se3_exp(np.array([0.0, 0.0, 0.45, 0.3, 0.1, 0.2]))
    follower = ObjectFollower(tracker, CAMERA, T, 0.0, 1.0 / RATE_HZ, OUTLINE_RULE)
    before = follower._belief
    there = se3_exp(np.array([0.1, -0.2, 0.05, 0.4, 0.3, -0.6]))
    follower.carry(there)
    np.testing.assert_allclose(follower._belief.T_world_target, there @ T, atol=1e-12)
    follower.carry(np.linalg.inv(there))
    np.testing.assert_allclose(follower._belief.covariance, before.covariance, atol=1e-12)
    np.testing.assert_allclose(follower._belief.T_world_target, T, atol=1e-12)


def test_an_outline_is_followed_by_one_camera_alone() -> None:
    table = {"position_m": [0.9, 0.0, 0.6], "resolution": [640, 480], "focal_px": [600.0, 600.0],
             "rate_hz": 30.0}  # fmt: skip
    cameras = {"wrist": {}, "stand": table}
    with pytest.raises(InputError, match=r"perception\.cameras.*stand.*one camera"):
        vg.run("mug", duration_s=0.1, cameras=cameras)
    assert load_cell("mug").watched == ("wrist",)
