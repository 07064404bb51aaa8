import numpy as np
import pytest
from estimation_scene import BOX, CAMERA, HAND, WALL, look_at, moving, pose_error

from vergence.errors import InputError, ShapeError
from vergence.estimation import CornerView, fit_pose
from vergence.geometry import se3_inverse, transform_points


def corners(rng, T_world_camera, T_world_target, shape=BOX, hidden=()):
    """The corners that a camera sees, with half a pixel of noise."""
    p = transform_points(se3_inverse(T_world_camera) @ T_world_target, shape)
    seen_px = CAMERA.project(p) + 0.5 * rng.normal(size=(len(shape), 2))
    seen_px[list(hidden)] = np.nan
    return CornerView(CAMERA, T_world_camera, seen_px)


@pytest.mark.parametrize("places", [[HAND], [WALL, HAND]])
def test_pose_in_the_world_lies_within_its_covariance(places):
    rng = np.random.default_rng(0)
    for time in np.linspace(0.0, 3.0, 10):
        truth = moving(time)
        fit = fit_pose(BOX, [corners(rng, place, truth, hidden=[3]) for place in places])
        assert fit, fit
        error = pose_error(fit.T_world_target, truth)
        assert error @ np.linalg.solve(fit.covariance, error) < 33.1  # χ²(6), one in 10⁵
        assert fit.points == 7 * len(places)


def test_second_camera_tells_the_two_poses_of_a_flat_square_apart():
    rng = np.random.default_rng(1)
    square = BOX[BOX[:, 2] > 0]
    views = [corners(rng, place, moving(0.5), square) for place in (look_at((6.0, 0.0, 4.0)), HAND)]
    assert len(fit_pose(square, views[:1]).alternatives) == 2
    assert fit_pose(square, views)


def test_bad_input_is_named():
    rng = np.random.default_rng(2)
    seen = corners(rng, WALL, moving(0.0))
    with pytest.raises(ShapeError, match="corners_px"):
        fit_pose(BOX[:4], [seen])
    with pytest.raises(InputError, match="noise_px"):
        fit_pose(BOX, [seen], noise_px=0.0)
    assert fit_pose(BOX, []).reason == "no image"
