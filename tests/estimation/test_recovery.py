import numpy as np
import pytest
from estimation_scene import BOX, HAND, WALL, look_at, moving, pose_error, view

from vergence.estimation import pose_from_points
from vergence.estimation.view import View
from vergence.geometry import se3, so3_exp


def flat(picture: View, T_world_target) -> View:
    """The four upper corners only."""
    upper = np.flatnonzero(BOX[:, 2] > 0)
    return picture._replace(
        features=upper,
        points=picture.points[upper],
        measured=picture.measured[upper],
        covariance=picture.covariance[upper],
    )


def nees(fit, truth):
    error = pose_error(fit.T_world_target, truth)
    return error @ np.linalg.solve(fit.covariance, error)


@pytest.mark.parametrize("seed", range(6))
def test_pose_is_found_from_one_picture_whatever_it_is(seed):
    rng = np.random.default_rng(seed)
    truth = se3(so3_exp(rng.uniform(-2.0, 2.0, 3)), rng.uniform(-0.1, 0.1, 3))
    fit = pose_from_points([view(rng, 1.0, truth)])
    assert fit
    assert fit.inliers == fit.points == len(BOX)
    assert nees(fit, truth) < 27.9  # χ²(6), one in ten thousand


def test_wrong_matches_are_left_out():
    rng = np.random.default_rng(7)
    for _ in range(10):
        picture = view(rng, 0.0, moving(0.5))
        picture.measured[[1, 6]] += rng.uniform(0.02, 0.06, (2, 2))
        fit = pose_from_points([picture, view(rng, 0.0, moving(0.5), HAND, "hand")])
        assert fit
        assert fit.inliers >= 2 * len(BOX) - 4
        assert nees(fit, moving(0.5)) < 30.0


def test_flat_target_far_away_in_one_camera_is_refused_as_ambiguous():
    rng = np.random.default_rng(8)
    far = look_at((6.0, 0.0, 4.0))
    picture = flat(view(rng, 0.0, moving(0.5), far, noise_px=1.0), moving(0.5))
    fit = pose_from_points([picture])
    assert not fit
    assert "two different poses" in fit.reason


def test_second_camera_settles_the_ambiguity():
    rng = np.random.default_rng(9)
    first = flat(view(rng, 0.0, moving(0.5), look_at((1.5, 0, 1.0))), moving(0.5))
    second = flat(view(rng, 0.0, moving(0.5), HAND, "hand"), moving(0.5))
    fit = pose_from_points([first, second])
    assert fit
    assert nees(fit, moving(0.5)) < 27.9


def test_failure_says_why():
    rng = np.random.default_rng(10)
    assert pose_from_points([]).reason == "no picture"
    few = pose_from_points([view(rng, 0.0, moving(0.0), features=[0, 1, 2])])
    assert "3 points" in few.reason
    picture = view(rng, 0.0, moving(0.0))
    nonsense = picture._replace(measured=rng.uniform(-0.3, 0.3, picture.measured.shape))
    assert not pose_from_points([nonsense])


def test_same_points_give_the_same_pose():
    picture = view(np.random.default_rng(11), 0.0, moving(0.3), WALL)
    first, second = pose_from_points([picture]), pose_from_points([picture])
    np.testing.assert_array_equal(first.T_world_target, second.T_world_target)
