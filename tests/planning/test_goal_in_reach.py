"""A goal that images put a little out of reach: first the nearest pose in reach is the goal."""

from dataclasses import replace

import numpy as np
import pytest

from vergence.estimation import CornerView, PoseFit, fit_pose
from vergence.planning import (
    Obstacle,
    OptimisedPlanner,
    Path,
    PlanFailure,
    PlanningProblem,
    Trajectory,
)
from vergence.robot import nearest_configuration
from vergence.studies.defaults.run import NOISE_PX
from vergence.studies.defaults.study import STARTS_SEED, camera_arm, draw
from vergence.studies.reach_scene import Scene


@pytest.fixture(scope="module")
def scene() -> Scene:
    return draw(camera_arm("ur5"), STARTS_SEED, 189)  # its goal stretches the arm


def beyond(scene: Scene, distance_m: float, deviation: float) -> PlanningProblem:
    """Return the scene with a goal out of reach by a distance, known with a deviation."""
    arm = scene.arm
    T = scene.T_world_goal.copy()
    away = T[:3, 3] / np.linalg.norm(T[:3, 3])
    for step in np.linspace(0.0, 0.5, 501):
        far = T.copy()
        far[:3, 3] += step * away
        if nearest_configuration(arm, far, scene.q_start)[1] > distance_m:
            return replace(scene.problem(), T_world_goal=far, goal_deviation=deviation)
    raise AssertionError("the arm reaches everywhere")


def test_a_goal_out_of_reach_within_its_deviation_is_neared(scene: Scene) -> None:
    path = OptimisedPlanner().plan(beyond(scene, 0.006, 0.004))
    assert isinstance(path, Path)
    missing = path.T_world_camera[-1][:3, 3] - beyond(scene, 0.006, 0.004).T_world_goal[:3, 3]
    assert 0.005 < np.linalg.norm(missing) < 0.012


@pytest.mark.parametrize("deviation", [0.0, 0.001])
def test_a_goal_farther_out_of_reach_is_refused(scene: Scene, deviation: float) -> None:
    refused = OptimisedPlanner().plan(beyond(scene, 0.006, deviation))
    assert isinstance(refused, PlanFailure)
    assert refused.obstacle is Obstacle.REACH


def test_the_deviation_of_a_goal_is_what_noise_makes_of_it(scene: Scene) -> None:
    """Of the goal's place in the world, as the poses of both images say it."""
    random, arm = np.random.default_rng(2), scene.arm
    images = (scene.seen_px(arm.forward_kinematics(scene.q_start)), scene.goal_px)
    off, told = [], []
    for _ in range(60):
        fits = []
        for px in images:
            noisy = px + NOISE_PX * random.standard_normal(px.shape)
            fits.append(
                fit_pose(scene.marks, [CornerView(scene.camera, np.eye(4), noisy)], NOISE_PX)
            )
        now, goal = fits
        if not (isinstance(now, PoseFit) and isinstance(goal, PoseFit)):
            continue
        asked = PlanningProblem.from_poses(now, goal, scene.marks, arm, scene.camera, scene.q_start)
        off.append(np.linalg.norm(asked.T_world_goal[:3, 3] - scene.T_world_goal[:3, 3]))
        told.append(asked.goal_deviation)
    rms = float(np.sqrt(np.mean(np.square(off))))
    assert 0.5 * np.mean(told) < rms < np.sqrt(3.0) * np.mean(told)


def test_a_path_ends_with_the_desired_image(scene: Scene) -> None:
    path = OptimisedPlanner().plan(beyond(scene, 0.006, 0.004))
    assert isinstance(path, Path)
    trajectory = Trajectory.of(path, desired_px=scene.goal_px)
    assert np.allclose(trajectory.reference(trajectory.duration).points_px, path.points_px[-1])
    after = trajectory.reference(trajectory.duration + 0.1)
    assert np.array_equal(after.points_px, scene.goal_px)
    assert after.velocity_px is None
    assert after.joint_rates is None
