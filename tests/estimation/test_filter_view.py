import numpy as np
import pytest
from estimation_scene import BOX, CAMERA, WALL, moving, project

from vergence.camera import Camera
from vergence.estimation import view_of
from vergence.geometry import se3_inverse
from vergence.signals import ImagePoints

BENT = Camera(640, 480, 500.0, 520.0, 320.0, 240.0, np.array([-0.2, 0.05, 1e-3, -2e-3, 0.01]))


def points(camera, **changes):
    given = {
        "camera": "wall",
        "time": 1.5,
        "points_px": camera.to_pixels(project(WALL, moving(0.3))),
        "covariance_px": np.tile([[0.5, 0.1], [0.1, 0.3]], (len(BOX), 1, 1)),
        "found": np.ones(len(BOX), bool),
        "reasons": ("",) * len(BOX),
    }
    return ImagePoints(**(given | changes))


@pytest.mark.parametrize("camera", [CAMERA, BENT], ids=["ideal", "distorted"])
def test_pixels_become_the_normalized_coordinates_of_the_pose(camera):
    view = view_of(points(camera), camera, WALL, BOX)
    np.testing.assert_allclose(view.measured, project(WALL, moving(0.3)), atol=1e-12)
    np.testing.assert_allclose(view.T_camera_world, se3_inverse(WALL))
    expected = camera.normalize_covariance(points(camera).covariance_px, view.measured)
    np.testing.assert_allclose(view.covariance, expected, rtol=1e-12)
    assert (view.camera, view.time, view.size) == ("wall", 1.5, len(BOX))


def test_features_may_be_a_choice():
    chosen = np.array([5, 2])
    some = points(CAMERA)
    few = ImagePoints(
        "wall", 1.5, some.points_px[chosen], some.covariance_px[chosen], some.found[:2], ("", "")
    )
    view = view_of(few, CAMERA, WALL, BOX, chosen)
    np.testing.assert_array_equal(view.points, BOX[chosen])
    np.testing.assert_array_equal(view.features, chosen)


@pytest.mark.parametrize(
    "covariance",
    [np.zeros((2, 2)), [[1.0, 1.0], [1.0, 1.0]], [[np.nan, 0.0], [0.0, 1.0]], -np.eye(2)],
    ids=["zero", "singular", "not a number", "negative"],
)
def test_points_with_an_impossible_covariance_are_left_out(covariance):
    spoiled = points(CAMERA).covariance_px.copy()
    spoiled[3] = covariance
    view = view_of(points(CAMERA, covariance_px=spoiled), CAMERA, WALL, BOX)
    assert 3 not in view.features
    assert view.size == len(BOX) - 1


def test_points_not_found_or_not_finite_are_left_out():
    places = points(CAMERA).points_px.copy()
    places[1, 0] = np.inf
    found = np.ones(len(BOX), bool)
    found[4] = False
    view = view_of(points(CAMERA, points_px=places, found=found), CAMERA, WALL, BOX)
    assert set(range(len(BOX))) - set(view.features) == {1, 4}
