"""How far a camera is from its photograph, by grey values: light, noise, what is hidden."""

import cv2
import numpy as np
import pytest

from vergence.arrays import ImageArray
from vergence.camera import Camera
from vergence.estimation.luminance_fit import LuminanceFit, LuminanceGoal
from vergence.geometry import se3, se3_exp, se3_inverse, so3_log

PLAIN = Camera(320, 240, focal_px=300)
BENT = Camera(320, 240, 300.0, 300.0, 160.0, 118.0, (-0.25, 0.05, 0.001, -0.001, 0.0))
DEPTH = 0.5
GOAL = se3(np.eye(3), np.array([0.0, 0.0, DEPTH]))  # of the plane z = 0 in the camera
SMALL = np.array([2e-4, -3e-4, 4e-4, 3e-4, 5e-4, -6e-4])  # m and rad


def seen(camera: Camera, T_camera_plane: np.ndarray) -> np.ndarray:
    """The exact image of a plane of waves, grey values."""
    v, u = np.indices((camera.height, camera.width))
    x, y = camera.normalize(np.column_stack((u.ravel(), v.ravel())).astype(float)).T
    rays = np.column_stack((x, y, np.ones_like(x)))
    normal, place = T_camera_plane[:3, 2], T_camera_plane[:3, 3]
    depth = (normal @ place) / (rays @ normal)
    X, Y, _ = ((rays * depth[:, None] - place) @ T_camera_plane[:3, :3]).T
    grey = 110 + 30 * np.sin(90 * X + 20 * Y) + 30 * np.cos(80 * Y - 25 * X)
    grey = grey + 15 * np.sin(31 * X * (1 + 3 * Y)) + 20 * Y
    return grey.reshape(camera.height, camera.width)


def stored(grey: np.ndarray, noise: float = 0.0, seed: int = 0) -> ImageArray:
    grey = grey + np.random.default_rng(seed).normal(0.0, noise, grey.shape)
    return grey.round().clip(0, 255).astype(np.uint8)


def fit(image: ImageArray, camera: Camera = PLAIN, level: int = 1) -> LuminanceFit:
    goal = LuminanceGoal(stored(seen(camera, GOAL)), camera, np.full(image.shape, DEPTH))
    found = goal.fit(image, level)
    assert found is not None
    return found


def off(found: LuminanceFit, xi: np.ndarray = SMALL) -> tuple[float, float]:
    """How far the pose is from the true one, m and rad."""
    E = se3_inverse(se3_exp(xi)) @ found.displacement.T_goal_camera
    return np.linalg.norm(E[:3, 3]), np.linalg.norm(so3_log(E[:3, :3].copy()))


def moved(camera: Camera = PLAIN, xi: np.ndarray = SMALL) -> np.ndarray:
    return seen(camera, se3_exp(-xi) @ GOAL)


@pytest.mark.parametrize("camera", [PLAIN, BENT], ids=["pinhole", "distorted"])
@pytest.mark.parametrize(("level", "share"), [(0, 0.1), (1, 0.1), (2, 0.2)])
def test_a_small_displacement_is_told(camera: Camera, level: int, share: float) -> None:
    distance, angle = off(fit(stored(moved(camera)), camera, level))
    assert distance < share * np.linalg.norm(SMALL[:3])
    assert angle < share * np.linalg.norm(SMALL[3:])


def test_at_the_goal_noise_alone_is_left_and_stated() -> None:
    squares = []
    for seed in range(30):
        found = fit(stored(seen(PLAIN, GOAL), 3.0, seed))
        T = found.displacement.T_goal_camera
        xi = np.concatenate((T[:3, 3], so3_log(T[:3, :3].copy())))
        squares.append(xi @ np.linalg.solve(found.displacement.covariance, xi))
    assert 3.0 < np.mean(squares) < 12.0  # 6 for a covariance as stated


@pytest.mark.parametrize("light", [0.6, 1.4])
def test_another_light_is_told_and_changes_nothing(light: float) -> None:
    found = fit(stored(light * moved() + 10.0))
    assert found.light == pytest.approx(light, rel=0.01)
    assert off(found)[0] < 0.1 * np.linalg.norm(SMALL[:3])


def test_a_hidden_fifth_has_no_say_and_is_known() -> None:
    image = stored(moved())
    v, u = np.indices((110, 140))
    image[60:170, 90:230] = np.where((u + 2 * v) // 12 % 2, 60, 170)
    found = fit(image)
    assert off(found)[0] < 0.1 * np.linalg.norm(SMALL[:3])
    assert 0.7 < found.displacement.agrees.mean() < 0.85


def test_clipped_pixels_have_no_say() -> None:
    bright = 1.6 * seen(PLAIN, GOAL)
    assert np.mean(bright > 255) > 0.05
    T = fit(stored(1.6 * moved())).displacement.T_goal_camera
    assert np.linalg.norm(T[:3, 3] - se3_exp(SMALL)[:3, 3]) < 0.15 * np.linalg.norm(SMALL[:3])


def test_an_image_of_something_else_is_unlike() -> None:
    blurred = cv2.GaussianBlur(np.random.default_rng(1).normal(110, 400, (240, 320)), (0, 0), 4)
    assert fit(stored(blurred)).unlike > 0.5
    assert fit(stored(moved(), 4.0)).unlike < 0.1


def test_an_image_without_texture_says_nothing() -> None:
    flat = np.full((240, 320), 90, dtype=np.uint8)
    assert LuminanceGoal(flat, PLAIN, np.full(flat.shape, DEPTH)).fit(flat) is None


def test_a_photograph_of_which_next_to_nothing_is_shown_says_nothing() -> None:
    image = stored(seen(PLAIN, GOAL))
    shown = np.zeros(image.shape, dtype=np.bool_)
    shown[100:108, 100:108] = True
    goal = LuminanceGoal(image, PLAIN, np.full(image.shape, DEPTH), shown)
    assert goal.coarsest == 0
    assert goal.fit(image) is None
