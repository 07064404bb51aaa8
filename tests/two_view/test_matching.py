"""Features of rendered pictures matched over large displacements, and the motion they tell."""

import numpy as np
import pytest

from vergence.cell import load_cell
from vergence.errors import InputError
from vergence.geometry import se3_inverse, so3_log
from vergence.simulation import SimulatedDriver
from vergence.vision.two_view import TwoView, estimate_two_view, match_features


@pytest.fixture(scope="module")
def driver():
    return SimulatedDriver(load_cell("puma560"))


def moved(driver, change_deg):
    q = driver.read().joints["puma"].position
    return driver.frame_at("wrist", "puma", q + np.deg2rad(change_deg))


@pytest.mark.parametrize(
    "change_deg", [[6.0, -4.0, 5.0, 8.0, -6.0, 20.0], [-5.0, 6.0, -9.0, -6.0, 9.0, 150.0]]
)
def test_matches_of_a_textured_object_give_the_motion_between_the_pictures(driver, change_deg):
    now, then = driver.first_frame("wrist"), moved(driver, change_deg)
    matches = match_features(now.image, then.image)
    assert len(matches.points_px) > 20
    view = estimate_two_view(matches.points_px, matches.points_star_px, driver.cameras["wrist"])
    assert isinstance(view, TwoView)
    T_star_now = se3_inverse(then.truth.T_world_camera) @ now.truth.T_world_camera
    error = view.rotation.T @ T_star_now[:3, :3]
    assert np.rad2deg(np.linalg.norm(so3_log(np.ascontiguousarray(error)))) < 1.0
    course = view.translation / np.linalg.norm(view.translation)
    true_course = T_star_now[:3, 3] / np.linalg.norm(T_star_now[:3, 3])
    assert np.rad2deg(np.arccos(np.clip(course @ true_course, -1, 1))) < 4.0


def test_pictures_with_nothing_in_them_say_so():
    blank, noise = np.full((120, 160), 90, np.uint8), np.zeros((0, 0), np.uint8)
    assert "texture" in match_features(blank, blank).reason
    assert match_features(noise, blank).reason.startswith("the current image")
    assert not match_features(blank, blank)


def test_matches_lie_inside_the_masks(driver):
    now, then = driver.first_frame("wrist"), moved(driver, [6.0, -4.0, 5.0, 8.0, -6.0, 20.0])
    left = np.zeros(now.image.shape, dtype=bool)
    left[:, : left.shape[1] // 2] = True
    matches = match_features(now.image, then.image, mask=left)
    assert len(matches.points_px)
    assert (matches.points_px[:, 0] < left.shape[1] // 2 + 1).all()
    with pytest.raises(InputError, match="desired"):
        match_features(now.image, then.image, mask_star=left[1:])
