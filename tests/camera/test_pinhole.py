"""The pinhole camera: maps that undo each other, and a border at half a pixel."""

import numpy as np
import pytest

from vergence.camera import Camera
from vergence.errors import InputError, ShapeError

DISTORTIONS = {
    "ideal": (0.0, 0.0, 0.0, 0.0, 0.0),
    "barrel": (-0.28, 0.07, 0.0, 0.0, 0.0),
    "cushion": (0.12, -0.02, 0.0, 0.0, 0.005),
    "tangential": (-0.1, 0.01, 1.5e-3, -2e-3, 0.0),
}


def camera_with(distortion: str) -> Camera:
    return Camera(640, 480, 610.0, 590.0, 301.5, 255.25, np.array(DISTORTIONS[distortion]))


@pytest.mark.parametrize("distortion", DISTORTIONS)
def test_normalizing_undoes_to_pixels_all_over_the_image(distortion: str) -> None:
    camera = camera_with(distortion)
    u, v = np.meshgrid(np.linspace(-0.5, 639.4, 17), np.linspace(-0.5, 479.4, 13))
    pixels = np.column_stack((u.ravel(), v.ravel()))
    np.testing.assert_allclose(camera.to_pixels(camera.normalize(pixels)), pixels, atol=1e-9)


@pytest.mark.parametrize("distortion", DISTORTIONS)
def test_every_depth_along_a_ray_projects_to_its_pixel(distortion: str) -> None:
    camera, rng = camera_with(distortion), np.random.default_rng(0)
    pixels = rng.uniform((0, 0), (639, 479), (50, 2))
    rays = np.column_stack((camera.normalize(pixels), np.ones(50)))
    for depth in (1e-3, 0.5, 80.0):
        np.testing.assert_allclose(camera.project(depth * rays), pixels, atol=1e-9)


def test_distortion_is_that_of_opencv() -> None:
    import cv2

    rng = np.random.default_rng(1)
    points = np.column_stack((rng.uniform(-0.4, 0.4, (40, 2)), np.ones(40)))
    for name in DISTORTIONS:
        camera = camera_with(name)
        theirs, _ = cv2.projectPoints(
            points, np.zeros(3), np.zeros(3), camera.matrix, camera.distortion
        )
        np.testing.assert_allclose(camera.project(points), theirs[:, 0], atol=1e-9)


def test_a_lens_gives_the_focal_length_in_cells_and_the_middle_of_the_image() -> None:
    camera = Camera.from_lens(16.0, (11.0, 13.0), 640, 480)
    assert camera.fx == pytest.approx(16e-3 / 11e-6)
    assert camera.fy == pytest.approx(16e-3 / 13e-6)
    assert (camera.cx, camera.cy) == (319.5, 239.5)
    np.testing.assert_allclose(
        camera.project(np.array([[0.0, 0.0, 2.0]])), [[319.5, 239.5]], atol=1e-12
    )


def test_the_image_reaches_half_a_pixel_beyond_the_outer_centres() -> None:
    camera = Camera(640, 480, 500.0, 500.0, 319.5, 239.5)
    inside = np.array([[-0.5, -0.5], [639.4999, 479.4999], [0.0, 0.0], [639.0, 479.0]])
    outside = np.array([[-0.5001, 5.0], [5.0, -0.5001], [639.5, 5.0], [5.0, 479.5]])
    assert camera.contains(inside).all()
    assert not camera.contains(outside).any()
    assert not camera.contains(np.array([[np.nan, 5.0], [np.inf, 5.0]])).any()


@pytest.mark.parametrize("margin", [0.5, 8.0, 100.0])
def test_a_margin_moves_every_border_inwards(margin: float) -> None:
    camera = Camera(640, 480, 500.0, 500.0, 319.5, 239.5)
    low, right, bottom = margin - 0.5, 639.5 - margin, 479.5 - margin
    middle, step = 240.0, 1e-6
    just_inside = [[low, middle], [right - step, middle], [middle, low], [middle, bottom - step]]
    just_outside = [[low - step, middle], [right, middle], [middle, low - step], [middle, bottom]]
    assert camera.contains(np.array(just_inside), margin).all()
    assert not camera.contains(np.array(just_outside), margin).any()


@pytest.mark.parametrize("distortion", DISTORTIONS)
def test_a_covariance_moves_with_the_points(distortion: str) -> None:
    camera, rng = camera_with(distortion), np.random.default_rng(2)
    covariance, middle = np.array([[0.4, 0.1], [0.1, 0.9]]), np.array([[560.0, 60.0]])
    pixels = rng.multivariate_normal(middle[0], covariance, 200_000)
    sampled = np.cov(camera.normalize(pixels).T)
    exact = camera.normalize_covariance(covariance[None], camera.normalize(middle))[0]
    np.testing.assert_allclose(sampled, exact, rtol=0.05)


@pytest.mark.parametrize("distortion", DISTORTIONS)
def test_a_velocity_moves_with_the_points(distortion: str) -> None:
    camera, px, velocity = camera_with(distortion), np.array([[560.0, 60.0]]), np.array([[9.0, 4]])
    moved = camera.normalize(px + 1e-4 * velocity) - camera.normalize(px - 1e-4 * velocity)
    exact = camera.normalize_velocity(velocity, camera.normalize(px))
    np.testing.assert_allclose(exact, moved / 2e-4, rtol=1e-6)


@pytest.mark.parametrize("distortion", DISTORTIONS)
def test_the_undistorted_camera_sees_all_that_the_camera_sees(distortion: str) -> None:
    camera = camera_with(distortion)
    wide = camera.undistorted()
    assert (wide is camera) == (distortion == "ideal")
    assert not wide.distorted
    u, v = np.meshgrid(np.linspace(-0.5, 639.4, 40), np.linspace(-0.5, 479.4, 30))
    pixels = np.column_stack((u.ravel(), v.ravel()))
    assert wide.contains(wide.to_pixels(camera.normalize(pixels))).all()


@pytest.mark.parametrize("distortion", DISTORTIONS)
def test_the_rectangle_lies_in_view_and_touches_every_side(distortion: str) -> None:
    camera = camera_with(distortion)
    x_min, x_max, y_min, y_max = camera.rectangle(5.0)
    x, y = np.meshgrid(np.linspace(x_min, x_max, 40), np.linspace(y_min, y_max, 40))
    inside = camera.to_pixels(np.column_stack((x.ravel(), y.ravel())))
    assert camera.contains(inside, 4.99).all()
    sides = np.concatenate((inside, (639, 479) - inside), axis=1).min(axis=0)
    np.testing.assert_allclose(sides, 4.5, atol=0.1)


def test_what_a_barrel_lens_folds_back_into_the_image_is_not_in_view() -> None:
    camera = Camera(640, 480, 400.0, 400.0, 319.5, 239.5, np.array([-0.3, 0.0, 0.0, 0.0, 0.0]))
    assert camera.reach == pytest.approx(np.sqrt(1 / 0.9))
    folded = np.array([[1.8, 0.0, 1.0], [0.5, 0.1, 1.0], [0.5, 0.1, -1.0]])
    assert camera.contains(camera.project(folded[:1])).all()
    assert camera.in_view(folded).tolist() == [False, True, False]


def test_an_image_that_its_distortion_folds_is_refused() -> None:
    with pytest.raises(InputError, match="one-to-one"):
        Camera(640, 480, 200.0, 200.0, 319.5, 239.5, np.array([-0.3, 0, 0, 0, 0])).undistorted()


@pytest.mark.parametrize("key", ["width", "height", "fx", "fy"])
@pytest.mark.parametrize("value", [0, -1])
def test_a_camera_without_size_or_focus_is_refused(key: str, value: int) -> None:
    parameters = {"width": 640, "height": 480, "fx": 500.0, "fy": 500.0, "cx": 0.0, "cy": 0.0}
    with pytest.raises(InputError, match=key) as caught:
        Camera(**parameters | {key: value})
    assert caught.value.key == key


def test_distortion_has_five_numbers_that_nobody_can_change() -> None:
    with pytest.raises(ShapeError, match="distortion"):
        Camera(640, 480, 500.0, 500.0, 0.0, 0.0, np.zeros(4))
    given = np.zeros(5)
    camera = Camera(640, 480, 500.0, 500.0, 0.0, 0.0, given)
    given[0] = 1.0
    assert not camera.distorted
    assert not camera.distortion.flags.writeable
