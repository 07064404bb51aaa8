"""The study of the defaults: judged by image and pose, strict about the back of the target."""

from dataclasses import replace

import numpy as np
import pytest

from vergence.assembly.limits_on_plan import limits_on_plan
from vergence.control import Limits
from vergence.geometry import se3_exp
from vergence.planning import Path
from vergence.robot import goal_configurations
from vergence.runtime.arrival import Arrival
from vergence.studies.defaults import plan as defaults_plan
from vergence.studies.defaults.checks import better
from vergence.studies.defaults.choices import CHOICES, DEFAULT, EVERY
from vergence.studies.defaults.judge import End, TrueScene
from vergence.studies.defaults.moving import AMPLITUDE_M, Drift, keep
from vergence.studies.defaults.plan import follow
from vergence.studies.defaults.run import serve
from vergence.studies.defaults.study import STARTS_SEED, camera_arm, draw
from vergence.studies.known_plan import plan
from vergence.studies.reach_scene import Scene


@pytest.fixture(scope="module")
def scene() -> Scene:
    return draw(camera_arm("gantry"), STARTS_SEED, 3)


def test_a_plan_brings_a_start_home_by_image_and_pose(scene: Scene) -> None:
    found = plan(scene, np.random.default_rng(0))
    assert isinstance(found.path, Path)
    finish = follow(scene, found.path, found.goal_px, np.random.default_rng(0))
    assert finish.end is End.REACHED
    assert finish.px < 1.0
    assert finish.m < 1e-3
    assert finish.deg < 0.1


def test_a_plan_that_passes_near_a_singularity_is_followed_to_its_end(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    far = draw(camera_arm("ur5"), STARTS_SEED, 10)
    found = plan(far, np.random.default_rng(10))
    assert isinstance(found.path, Path)
    assert follow(far, found.path, found.goal_px, np.random.default_rng(10)).end is End.REACHED
    # A law that keeps its distance from singularities is held on the way.
    away = Limits(manipulability_share=0.2)
    monkeypatch.setattr(defaults_plan, "limits_on_plan", lambda *_: away)
    assert follow(far, found.path, found.goal_px, np.random.default_rng(10)).end is not End.REACHED


def test_what_the_user_states_holds_on_a_plan_too() -> None:
    stated = Limits(view_margin_px=3.0, approach_rate_hz=1.0, manipulability_share=0.4)
    on_plan = limits_on_plan(stated, 10.0, 0.01, 1 / 30)
    assert on_plan.view_margin_px == 3.0
    assert on_plan.approach_rate_hz == 1.0
    assert on_plan.manipulability_share == 0.4
    assert on_plan.joint_margin == pytest.approx(0.0025)
    assert limits_on_plan(Limits(), 10.0, 0.01, 1 / 5).approach_rate_hz == 5.0


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


@pytest.mark.parametrize(("cell", "index"), [("gantry", 35), ("gantry", 205), ("panda", 149)])
def test_an_oblique_start_or_goal_is_drawn_in_front_of_the_target(cell: str, index: int) -> None:
    drawn = draw(camera_arm(cell), STARTS_SEED, index)  # edge-on: the first one drawn is behind
    middle = drawn.points_world.mean(axis=0)
    for T in (drawn.arm.forward_kinematics(drawn.q_start), drawn.T_world_goal):
        assert drawn.T_world_target[:3, 2] @ (T[:3, 3] - middle) > 0.0


def test_the_right_image_from_the_wrong_pose_is_not_reached(scene: Scene) -> None:
    true = TrueScene(scene)
    goal = goal_configurations(scene.arm, scene.T_world_goal.copy(), scene.q_start, 1)[0]
    assert true.finish(goal, End.STALLED, 1.0, "").end is End.REACHED
    off = goal + np.array([3e-3, *np.zeros(scene.arm.joint_count - 1)])
    assert true.finish(off, End.STALLED, 1.0, "").end is End.STALLED


def test_noise_in_the_goals_image_is_no_excuse_for_more_than_it_explains(scene: Scene) -> None:
    step = 1e-5
    J = [
        (scene.seen_px(scene.T_world_goal @ se3_exp(twist)) - scene.goal_px).ravel() / step
        for twist in step * np.eye(6)
    ]
    information, axes = np.linalg.eigh(np.array(J) @ np.array(J).T / 0.3**2)
    least_known = axes[:, 0] / np.sqrt(information[0])  # one deviation
    true = TrueScene(scene, goal_noise_px=0.3)
    for deviations, end in ((2.0, End.REACHED), (12.0, End.STALLED)):
        T = scene.T_world_goal @ se3_exp(deviations * least_known)
        q = goal_configurations(scene.arm, T, scene.q_start, 1)[0]
        assert true.finish(q, End.STALLED, 1.0, "").end is end
        assert TrueScene(scene).finish(q, End.STALLED, 1.0, "").end is End.STALLED


def test_a_start_at_its_goal_outside_the_joint_margin_is_reached_at_once(scene: Scene) -> None:
    goal = goal_configurations(scene.arm, scene.T_world_goal.copy(), scene.q_start, 1)[0]
    there = replace(scene, q_start=goal)
    for choice in (choice for choice in CHOICES if choice.joint_margin < 0.015):
        finish = serve(there, choice, np.random.default_rng(0))
        assert finish.end is End.REACHED
        assert finish.time < 3.0


def test_a_name_for_what_holds_an_arm_is_tried(monkeypatch: pytest.MonkeyPatch) -> None:
    held = draw(camera_arm("ur5"), STARTS_SEED, 1)
    finish = serve(held, CHOICES[0], np.random.default_rng(1))
    assert (finish.end, finish.reason) == (End.STALLED, "joint margin")
    monkeypatch.setattr(Arrival, "active", ())  # so that a local minimum is claimed
    assert serve(held, CHOICES[0], np.random.default_rng(1)).end is End.UNNAMED


def test_a_moving_target_is_followed_only_if_its_motion_is_fed_forward(scene: Scene) -> None:
    drift = Drift(np.array([1.0, 0.0, 0.0]), period_s=8.0)
    fed, not_fed = (
        keep(scene, DEFAULT, fed_forward, drift, np.random.default_rng(0))
        for fed_forward in (None, False)
    )
    assert fed.kept
    assert fed.rms_px < 1.0
    assert not not_fed.kept
    assert drift.moved(scene, 2.0).T_world_target[0, 3] == pytest.approx(
        scene.T_world_target[0, 3] + AMPLITUDE_M
    )


def test_a_choice_is_better_only_beyond_chance() -> None:
    default = np.zeros((20, 1), dtype=np.bool_)
    luck, clearly = default.copy(), default.copy()
    luck[:3] = clearly[:9] = True
    assert better(np.hstack((default, luck))) == 0
    assert better(np.hstack((default, luck, clearly))) == 1
    assert better(np.hstack((clearly, default))) == 0


def test_every_combination_is_tried_once_and_the_default_first() -> None:
    assert EVERY[0] == DEFAULT
    assert len(set(EVERY)) == len(EVERY) == 48
    assert set(CHOICES) < set(EVERY)
