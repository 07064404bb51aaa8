"""Features of rendered images matched over large displacements, and the motion they tell."""

import cv2
import numpy as np
import pytest

from real_images import IMAGES, PACKAGE
from vergence.camera import Camera
from vergence.cell import load_cell
from vergence.errors import ShapeError
from vergence.geometry import se3_inverse, so3_exp, so3_log
from vergence.simulation import SimulatedDriver
from vergence.vision import TwoView, TwoViewFailure, estimate_two_view
from vergence.vision.matching import Compared, Sift, compare_images, match_features


@pytest.fixture(scope="module")
def driver():
    return SimulatedDriver(load_cell("puma560"))


def moved(driver, change_deg):
    q = driver.read().joints["puma"].position
    return driver.frame_at("wrist", "puma", q + np.deg2rad(change_deg))


@pytest.mark.parametrize(
    "change_deg", [[6.0, -4.0, 5.0, 8.0, -6.0, 20.0], [-5.0, 6.0, -9.0, -6.0, 9.0, 150.0]]
)
def test_matches_of_a_textured_object_give_the_motion_between_the_images(driver, change_deg):
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


def test_images_with_nothing_in_them_say_so():
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
    with pytest.raises(ShapeError, match="mask"):
        match_features(now.image, then.image, mask_star=left[1:])


FAR_DEG = [-5.0, 6.0, -9.0, -6.0, 9.0, 150.0]


@pytest.mark.parametrize("change_deg", [[6.0, -4.0, 5.0, 8.0, -6.0, 20.0], FAR_DEG])
def test_a_comparison_keeps_right_matches_alone(driver, change_deg):
    now, then = driver.first_frame("wrist"), moved(driver, change_deg)
    found = compare_images(now.image, then.image, driver.cameras["wrist"], Sift())
    assert isinstance(found, Compared)
    on_target = driver.world.anchor("wrist", found.matches.points_px)
    known = np.isfinite(on_target).all(axis=1)
    T = se3_inverse(then.truth.T_world_camera) @ now.truth.T_world_target
    true_px = driver.cameras["wrist"].project(on_target[known] @ T[:3, :3].T + T[:3, 3])
    error = np.linalg.norm(true_px - found.matches.points_star_px[known], axis=1)
    assert known.sum() > 30
    assert error.max() < 2.0
    assert np.median(error) < 0.3


@pytest.mark.parametrize(
    ("spoilt", "word"),
    [
        (lambda image: image[:, ::-1].copy(), "mirrored"),
        (lambda image: cv2.GaussianBlur(image, (0, 0), 12), "blurred"),
        (lambda image: np.clip(image * 4.0 + 90, 0, 255).astype(np.uint8), "white"),
        (lambda image: np.full_like(image, 128), "without texture"),
        (lambda image: (image // 40).astype(np.uint8), "black"),
    ],
    ids=["mirrored", "blurred", "over-exposed", "uniform", "dark"],
)
def test_a_goal_image_that_shows_nothing_is_refused_with_what_is_wrong(driver, spoilt, word):
    now, then = driver.first_frame("wrist"), moved(driver, FAR_DEG)
    found = compare_images(now.image, spoilt(then.image), driver.cameras["wrist"], Sift())
    assert isinstance(found, TwoViewFailure)
    assert word in found.reason


def test_images_of_different_things_have_no_motion_in_common(driver):
    random, camera = np.random.default_rng(4), driver.cameras["wrist"]
    things = [driver.first_frame("wrist").image]
    for blur in (1.0, 2.0, 4.0, 8.0):
        noise = cv2.GaussianBlur(random.normal(size=things[0].shape), (0, 0), blur)
        things.append(np.clip(128 + 60 * noise / noise.std(), 0, 255).astype(np.uint8))
    for i, image in enumerate(things):
        for other in things[i + 1 :]:
            assert isinstance(compare_images(image, other, camera, Sift()), TwoViewFailure)


def test_a_turn_of_the_camera_alone_is_told_as_such(driver):
    now, camera = driver.first_frame("wrist"), driver.cameras["wrist"]
    R = so3_exp(np.deg2rad([3.0, -4.0, 25.0]))
    H = camera.matrix @ R @ np.linalg.inv(camera.matrix)
    turned = cv2.warpPerspective(now.image, H, (640, 480))
    found = compare_images(now.image, turned, camera, Sift())
    assert isinstance(found, Compared)
    assert found.view is None
    error = so3_log(np.ascontiguousarray(found.rotation.T @ R))
    assert np.rad2deg(np.linalg.norm(error)) < 0.1


REAL = Camera(384, 288, focal_px=550.0)  # about


def real(name):
    assert IMAGES.is_dir(), f"{PACKAGE} is missing"
    image = cv2.imread(str(IMAGES / name), cv2.IMREAD_GRAYSCALE)
    return cv2.resize(image, (384, 288), interpolation=cv2.INTER_AREA)


@pytest.mark.parametrize("number", [40, 79])
def test_real_images_of_one_thing_tell_the_same_motion_both_ways(number):
    images = real("cube/image.0000.pgm"), real(f"cube/image.{number:04d}.pgm")
    there, back = (compare_images(*pair, REAL, Sift()) for pair in (images, images[::-1]))
    assert min(len(there.matches.points_px), len(back.matches.points_px)) > 50
    motions = [
        [one.rotation, *(v.rotation for v in one.view.alternatives)] for one in (there, back)
    ]
    apart = min(np.linalg.norm(so3_log(A @ B)) for A in motions[0] for B in motions[1])
    assert np.rad2deg(apart) < 2.0


def test_real_images_of_different_things_are_refused():
    names = [
        "cube/image.0000.pgm", "mire-2/image.0001.pgm", "Klimt/Klimt.pgm",
        "Solvay/Solvay_conference_1927_Version2_640x440.png", "calibration/grid36-01.pgm",
    ]  # fmt: skip
    images = [real(name) for name in names]
    for i, image in enumerate(images):
        for other in images[i + 1 :]:
            assert isinstance(compare_images(image, other, REAL, Sift()), TwoViewFailure)


def test_a_texture_that_repeats_itself_is_refused():
    tile = cv2.GaussianBlur(np.random.default_rng(0).normal(size=(60, 60)), (0, 0), 2)
    repeated = np.tile(np.clip(128 + 60 * tile / tile.std(), 0, 255).astype(np.uint8), (30, 30))
    checks = ((np.indices((1800, 1800)) // 60).sum(axis=0) % 2 * 200).astype(np.uint8)
    camera = Camera(640, 480, focal_px=600.0)
    for texture in (repeated, checks):
        images = []
        for turn, shift in ((0.0, 0.0), (0.35, 0.12)):
            R = so3_exp(np.array([0.05, -0.07, turn]) * (turn > 0))
            plane = np.array([[1, 0, -900], [0, 1, -900], [0, 0, 600.0]]) / 600.0
            H = camera.matrix @ (R @ plane + np.outer([shift, 0.03, 0.05], [0, 0, 1.0]))
            images.append(cv2.warpPerspective(texture, H, (640, 480)))
        assert isinstance(compare_images(*images, camera, Sift()), TwoViewFailure)
