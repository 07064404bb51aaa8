"""Where a photograph was taken, told by images from known poses of the arm."""

import numpy as np
import pytest

from vergence.camera import Camera
from vergence.estimation.displacement import fit_displacement
from vergence.estimation.goal_fit import (
    GoalGuess,
    Prior,
    arm_image,
    fit_goal,
    points_in,
)
from vergence.geometry import pose_difference, se3, se3_inverse, so3_exp, transform_points

CAMERA = Camera(640, 480, focal_px=600)
NOISE_PX = 0.2
COUNT = 16


def scene(rng, flat):
    """Return points in the world, the photograph's pose, and the camera's at the start."""
    points = rng.uniform(-0.12, 0.12, (COUNT, 3)) * [1, 1, 0.0 if flat else 0.5] + [0, 0, 0.5]
    T_goal = se3(so3_exp(rng.normal(size=3) * 0.05), rng.normal(size=3) * 0.02)
    T_start = se3(so3_exp(rng.normal(size=3) * 0.2), np.array([0.06, -0.05, -0.08]))
    return points, T_goal, T_start


def seen(rng, T, points):
    px = CAMERA.project(points_in(T, points)) + NOISE_PX * rng.normal(size=(COUNT, 2))
    return arm_image(CAMERA, T, px, np.full(COUNT, NOISE_PX), np.ones(COUNT, bool))


def images_on_the_way(rng, T_start, T_goal, points, count):
    """Return images from the start on towards the goal, a tenth of the way apart."""
    step = pose_difference(T_goal, T_start) / 10.0
    poses = [
        se3(so3_exp(k * step[3:]) @ T_start[:3, :3], T_start[:3, 3] + k * step[:3])
        for k in range(count)
    ]
    return [seen(rng, T, points) for T in poses]


def scaled(T_start, T_goal, points, factor):
    """Return the scene as two images cannot tell it from the true one: larger by a factor."""
    far = points_in(T_start, points) * factor
    T = se3_inverse(T_start) @ T_goal
    T[:3, 3] *= factor
    return GoalGuess(T_start @ T, transform_points(T_start, far))


@pytest.mark.parametrize("flat", [True, False])
@pytest.mark.parametrize("factor", [0.6, 1.7])
def test_the_arms_own_motion_tells_the_scale(flat, factor):
    rng = np.random.default_rng(1)
    points, T_goal, T_start = scene(rng, flat)
    guess = scaled(T_start, T_goal, points, factor)
    images = images_on_the_way(rng, T_start, T_goal, points, 5)
    prior = Prior(points_in(T_start, guess.points_world)[:, 2], 0.7)
    before = fit_goal(guess, seen(rng, T_goal, points), images[:1], prior)
    after = fit_goal(guess, seen(rng, T_goal, points), images, prior)
    wrong = np.linalg.norm(pose_difference(guess.T_world_goal, T_goal)[:3])
    error = np.linalg.norm(pose_difference(after.T_world_goal, T_goal)[:3])
    assert error < 0.15 * wrong
    deviations = [np.sqrt(np.trace(fit.covariance[:3, :3])) for fit in (before, after)]
    assert deviations[1] < 0.2 * deviations[0]


def test_a_guess_with_points_behind_a_camera_is_no_pose():
    rng = np.random.default_rng(6)
    points, T_goal, T_start = scene(rng, flat=False)
    image, goal = seen(rng, T_start, points), seen(rng, T_goal, points)
    behind = GoalGuess(T_goal, points - [0.0, 0.0, 2.0])
    assert fit_goal(behind, goal, [image], Prior(np.full(COUNT, 0.5), 0.7)) is None


def test_the_stated_covariance_covers_the_errors():
    rng = np.random.default_rng(2)
    squares = []
    for _ in range(40):
        points, T_goal, T_start = scene(rng, flat=False)
        images = images_on_the_way(rng, T_start, T_goal, points, 6)
        guess = scaled(T_start, T_goal, points, 1.2)
        prior = Prior(points_in(T_start, guess.points_world)[:, 2], 0.7)
        fit = fit_goal(guess, seen(rng, T_goal, points), images, prior)
        error = pose_difference(fit.T_world_goal, T_goal)
        squares.append(error @ np.linalg.solve(fit.covariance, error))
    assert 2.0 < np.median(squares) < 9.0  # 5.3 for six degrees of freedom
    assert np.mean(np.array(squares) > 22.5) < 0.05


def test_a_wrong_point_does_not_move_the_pose():
    rng = np.random.default_rng(3)
    points, T_goal, T_start = scene(rng, flat=False)
    images = images_on_the_way(rng, T_start, T_goal, points, 6)
    goal = seen(rng, T_goal, points)
    goal.points[4] += 0.1
    guess = scaled(T_start, T_goal, points, 1.0)
    prior = Prior(points_in(T_start, guess.points_world)[:, 2], 0.7)
    fit = fit_goal(guess, goal, images, prior)
    assert np.linalg.norm(pose_difference(fit.T_world_goal, T_goal)[:3]) < 2e-3
    assert np.flatnonzero(~fit.agrees).tolist() == [4]


def test_a_displacement_is_found_with_a_covariance_that_covers_it():
    rng = np.random.default_rng(4)
    squares = []
    for _ in range(60):
        points = rng.uniform(-0.12, 0.12, (30, 3)) * [1, 1, 0.3] + [0, 0, 0.4]
        T = se3(so3_exp(0.02 * rng.normal(size=3)), 0.003 * rng.normal(size=3))
        px = CAMERA.project(points_in(T, points)) + 0.1 * rng.normal(size=(30, 2))
        normalized = CAMERA.normalize(px)
        covariance = np.tile((0.1 / 600) ** 2 * np.eye(2), (30, 1, 1))
        found = fit_displacement(normalized, covariance, points, np.zeros(30))
        error = pose_difference(found.T_goal_camera, T)
        squares.append(error @ np.linalg.solve(found.covariance, error))
        assert np.linalg.norm(error[:3]) < 1e-3
    assert 3.0 < np.median(squares) < 8.0


def test_points_that_disagree_widen_the_confidence_region():
    rng = np.random.default_rng(5)
    points = rng.uniform(-0.1, 0.1, (30, 3)) + [0, 0, 0.4]
    covariance = np.tile((0.1 / 600) ** 2 * np.eye(2), (30, 1, 1))
    regions = []
    for noise in (0.1, 1.0):
        px = CAMERA.project(points) + noise * rng.normal(size=(30, 2))
        found = fit_displacement(CAMERA.normalize(px), covariance, points, np.zeros(30))
        regions.append(found.at_most()[0])
    assert regions[1] > 3.0 * regions[0]


@pytest.mark.parametrize("seed", range(3))
def test_depths_that_may_be_off_widen_the_confidence_region_away_from_the_goal_alone(seed):
    rng = np.random.default_rng([8, seed])
    points = rng.uniform(-0.1, 0.1, (40, 3)) * [1, 1, 0.5] + [0, 0, 0.4]
    believed = points * (0.4 / points[:, 2:])  # at one depth
    relief = np.full(40, np.std(points[:, 2]) / 0.4)
    covariance = np.tile((0.03 / 600) ** 2 * np.eye(2), (40, 1, 1))
    doubt_m = []
    for away_m in (0.006, 0.0):
        T = se3(np.eye(3), away_m * np.array([0.8, -0.6, 0.0]))
        px = CAMERA.project(points_in(T, points)) + 0.03 * rng.normal(size=(40, 2))
        found = fit_displacement(CAMERA.normalize(px), covariance, believed, relief)
        assert found.agrees.sum() > 36
        error = pose_difference(found.T_goal_camera, T)
        assert error @ np.linalg.solve(found.covariance, error) < 22.5  # one in a thousand
        doubt_m.append(found.at_most()[0] - found.distance_m)
    assert doubt_m[1] < 0.75 * doubt_m[0]
