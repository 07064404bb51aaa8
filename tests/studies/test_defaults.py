"""The study of the defaults: judged by image and pose, strict about the back of the target."""

from dataclasses import replace

import numpy as np
import pytest

from vergence.planning import Path
from vergence.robot import goal_configurations
from vergence.studies.defaults import CHOICES, STARTS_SEED, camera_arm, draw
from vergence.studies.defaults_run import End, TrueScene, follow, plan, serve
from vergence.studies.reach_scene import Scene


@pytest.fixture(scope="module")
def scene() -> Scene:
    return draw(camera_arm("gantry"), STARTS_SEED, 3)


def test_a_plan_brings_a_start_home_by_image_and_pose(scene: Scene) -> None:
    found = plan(scene, np.random.default_rng(0))
    assert isinstance(found.path, Path)
    finish = follow(scene, found.path, np.random.default_rng(0))
    assert finish.end is End.REACHED
    assert finish.px < 1.0
    assert finish.m < 1e-3
    assert finish.deg < 0.1


def test_a_camera_behind_the_target_has_broken_a_rule(scene: Scene) -> None:
    true, middle = TrueScene(scene), scene.points_world.mean(axis=0)
    T = scene.T_world_goal.copy()
    assert true.look(scene.q_start)[2] is None
    T[:3, 3] += 2.0 * (middle - T[:3, 3])
    free = np.full(scene.arm.joint_count, 100.0)
    arm = replace(scene.arm, q_min=-free, q_max=free)
    behind = goal_configurations(arm, T, scene.q_start, 1)
    assert len(behind)
    assert true.look(behind[0])[2] is End.BEHIND


def test_the_right_image_from_the_wrong_pose_is_not_reached(scene: Scene) -> None:
    true = TrueScene(scene)
    goal = goal_configurations(scene.arm, scene.T_world_goal.copy(), scene.q_start, 1)[0]
    assert true.finish(goal, End.STALLED, 1.0, "").end is End.REACHED
    off = goal + np.array([3e-3, *np.zeros(scene.arm.joint_count - 1)])
    assert true.finish(off, End.STALLED, 1.0, "").end is End.STALLED


def test_a_start_at_its_goal_outside_the_joint_margin_is_reached_at_once(scene: Scene) -> None:
    goal = goal_configurations(scene.arm, scene.T_world_goal.copy(), scene.q_start, 1)[0]
    there = replace(scene, q_start=goal)
    for choice in (choice for choice in CHOICES if choice.joint_margin < 0.015):
        finish = serve(there, choice, np.random.default_rng(0))
        assert finish.end is End.REACHED
        assert finish.time < 3.0
