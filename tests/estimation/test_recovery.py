import numpy as np
import pytest
from estimation_scene import BOX, HAND, WALL, look_at, moving, pose_error, view

from vergence.estimation import pose_from_points
from vergence.estimation.pose_minima import (
    descend,
    is_apart,
    pose_minima,
    with_linear_translation,
)
from vergence.estimation.recovery import RIVAL
from vergence.estimation.view import View
from vergence.geometry import se3, so3_exp, transform_points


def flat(image: View) -> View:
    """The four upper corners only."""
    upper = np.flatnonzero(BOX[:, 2] > 0)
    return image._replace(
        features=upper,
        points=image.points[upper],
        measured=image.measured[upper],
        covariance=image.covariance[upper],
    )


def nees(fit, truth):
    error = pose_error(fit.T_world_target, truth)
    return error @ np.linalg.solve(fit.covariance, error)


@pytest.mark.parametrize("seed", range(6))
def test_pose_is_found_from_one_image_whatever_it_is(seed):
    rng = np.random.default_rng(seed)
    truth = se3(so3_exp(rng.uniform(-2.0, 2.0, 3)), rng.uniform(-0.1, 0.1, 3))
    fit = pose_from_points([view(rng, 1.0, truth)])
    assert fit
    assert fit.inliers == fit.points == len(BOX)
    assert nees(fit, truth) < 27.9  # χ²(6), one in ten thousand


def test_wrong_matches_are_left_out():
    rng = np.random.default_rng(7)
    for _ in range(10):
        image = view(rng, 0.0, moving(0.5))
        image.measured[[1, 6]] += rng.uniform(0.02, 0.06, (2, 2))
        fit = pose_from_points([image, view(rng, 0.0, moving(0.5), HAND, "hand")])
        assert fit
        assert fit.inliers >= 2 * len(BOX) - 4
        assert nees(fit, moving(0.5)) < 30.0


def test_flat_target_far_away_in_one_camera_is_refused_as_ambiguous():
    rng = np.random.default_rng(8)
    far = look_at((6.0, 0.0, 4.0))
    image = flat(view(rng, 0.0, moving(0.5), far, noise_px=1.0))
    fit = pose_from_points([image])
    assert not fit
    assert "two different poses" in fit.reason
    assert len(fit.alternatives) == 2
    assert sum(pose.weight for pose in fit.alternatives) == pytest.approx(1.0)
    assert min(nees(pose, moving(0.5)) for pose in fit.alternatives) < 27.9


def test_second_camera_settles_the_ambiguity():
    rng = np.random.default_rng(9)
    first = flat(view(rng, 0.0, moving(0.5), look_at((1.5, 0, 1.0))))
    second = flat(view(rng, 0.0, moving(0.5), HAND, "hand"))
    fit = pose_from_points([first, second])
    assert fit
    assert nees(fit, moving(0.5)) < 27.9


def test_failure_says_why():
    rng = np.random.default_rng(10)
    assert pose_from_points([]).reason == "no image"
    few = pose_from_points([view(rng, 0.0, moving(0.0), features=[0, 1, 2])])
    assert "3 points" in few.reason
    image = view(rng, 0.0, moving(0.0))
    nonsense = image._replace(measured=rng.uniform(-0.3, 0.3, image.measured.shape))
    assert not pose_from_points([nonsense])


def test_same_points_give_the_same_pose():
    image = view(np.random.default_rng(11), 0.0, moving(0.3), WALL)
    first, second = pose_from_points([image]), pose_from_points([image])
    np.testing.assert_array_equal(first.T_world_target, second.T_world_target)


SQUARE = 0.03 * np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
GRID = 0.03 * np.array([[x, y, 0.0] for x in (-1, 0, 1) for y in (-1, 0, 1)])


def raised(points, height):
    """The points with the first of them off their plane, m."""
    return points + np.eye(len(points))[:, :1] * [0.0, 0.0, height]


def one_image(rng, points, T_camera_target, noise_px=0.5):
    """What a camera of 600 px focal length at the origin of the world sees."""
    places = transform_points(T_camera_target, points)
    sigma = noise_px / 600.0
    measured = places[:, :2] / places[:, 2:] + sigma * rng.normal(size=(len(points), 2))
    covariance = np.tile(sigma**2 * np.eye(2), (len(points), 1, 1))
    return View("one", 0.0, np.eye(4), np.arange(len(points)), points, measured, covariance)


@pytest.mark.parametrize("distance", [0.3, 0.8])
@pytest.mark.parametrize("height", [0.0, 2e-5, 2e-4, 1e-3])
@pytest.mark.parametrize("target", [SQUARE, GRID])
def test_nearly_flat_target_is_never_given_a_wrong_pose_as_certain(target, height, distance):
    rng = np.random.default_rng(12)
    points, facing = raised(target, height), np.diag([1.0, -1.0, -1.0])
    for _ in range(60):
        axis = rng.normal(size=3) * [1, 1, 0]
        tilt = np.deg2rad(rng.choice([5.0, 20.0, 40.0])) * axis / np.linalg.norm(axis)
        truth = se3(so3_exp(tilt) @ facing, np.array([0.02, -0.01, distance]))
        fit = pose_from_points([one_image(rng, points, truth)])
        poses = [fit] if fit else fit.alternatives
        # χ²(6) is 42 at five standard deviations.
        assert min((nees(pose, truth) for pose in poses), default=0.0) < 42.0, fit


def test_near_target_off_its_plane_is_given_a_pose():
    rng = np.random.default_rng(13)
    truth = se3(so3_exp(np.array([np.pi - 0.5, 0.2, 0.1])), np.array([0.02, -0.01, 0.3]))
    fits = [pose_from_points([one_image(rng, raised(GRID, 0.02), truth)]) for _ in range(20)]
    assert all(fits)


def test_every_local_minimum_is_found():
    rng = np.random.default_rng(14)
    for _ in range(20):
        points = rng.uniform(-0.05, 0.05, (5, 3)) * [1.0, 1.0, rng.choice([0.0, 0.1, 1.0])]
        truth = se3(so3_exp(rng.uniform(-2, 2, 3)), np.array([0.0, 0.0, rng.uniform(0.2, 1.0)]))
        seen = one_image(rng, points, truth)
        minima = pose_minima(seen, truth)
        for _ in range(60):
            arguments = seen.poses, seen.points, seen.measured
            start = with_linear_translation(so3_exp(2.0 * rng.normal(size=3)), *arguments)
            pose, _, square = descend(start, *arguments, seen.covariance, 60)
            if square < minima[0].square + RIVAL:
                assert any(not is_apart(pose, known.pose, np.eye(4)) for known in minima)


def test_three_cameras_with_two_points_each_give_a_pose():
    rng = np.random.default_rng(15)
    truth = moving(0.5)
    places = (WALL, HAND, look_at((-0.6, -0.5, 0.7)))
    views = [
        view(rng, 0.0, truth, place, str(k), features=[2 * k, 2 * k + 1])
        for k, place in enumerate(places)
    ]
    fit = pose_from_points(views)
    assert fit
    assert nees(fit, truth) < 27.9
    views[0].measured[0] += 0.1
    assert "contradict" in pose_from_points(views).reason
