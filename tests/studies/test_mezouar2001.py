"""The study of the third paper: its scene, its ideal loop, its methods, and its checks."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from vergence.cell import load_cell
from vergence.experiments.workers import Workers
from vergence.geometry import se3, se3_inverse, so3_exp, so3_log, transform_points
from vergence.planning import OptimisedPlanner
from vergence.planning import Path as PlannedPath
from vergence.studies.ideal_loop import ARRIVED_PX, PERIOD, Ending, IdealLoop
from vergence.studies.mezouar2001.methods import (
    CLASSICAL,
    METHODS,
    Belief,
    Method,
    plan_between_images,
    position_based,
    position_based_on_object,
    servo,
    too_close,
)
from vergence.studies.mezouar2001.misprint import twist_of
from vergence.studies.mezouar2001.study import reproduce, success_rate
from vergence.studies.mezouar2001.trials import (
    End,
    Trial,
    is_infeasible,
    try_start,
    wrong_beliefs,
)
from vergence.studies.reach_scene import END_MARGIN_PX, Scene

CHECKS = {
    "straight.leaves_view",
    "straight.joint5_limit",
    "visibility_only.in_view",
    "visibility_only.joint5_limit",
    "both.in_view",
    "both.joint_margin",
    "optimised.in_view",
    "optimised.joint_margin",
    "tracking.error_max_px",
    "tracking.final_error_px",
    "tracking.final_pose_error_m",
    "classical.image_based_fails",
    "classical.position_based_fails",
    "misprint.plus_in_l_w_inverse",
    "perturbed.success_rate",
    "random.success_rate",
    "random_roll.success_rate",
}


@pytest.fixture(scope="module")
def scene() -> Scene:
    return Scene.of(load_cell("gantry"))


@pytest.fixture(scope="module")
def near(scene: Scene) -> Scene:
    """The scene with a start a few centimetres and degrees from the goal."""
    q = OptimisedPlanner().plan(scene.problem()).q[-8]
    return replace(scene, q_start=np.array(q))


def loop_of(scene: Scene, noise_px: float = 0.0) -> IdealLoop:
    return IdealLoop(scene.arm, scene.camera, scene.points_world, scene.goal_px, noise_px)


def test_the_displacement_is_the_papers(scene: Scene) -> None:
    motion = scene.problem().T_goal_start
    np.testing.assert_allclose(np.abs(motion[:3, 3]), [0.82, 0.80, 0.45], atol=1e-3)
    turn = np.degrees(so3_log(np.ascontiguousarray(motion[:3, :3])))
    np.testing.assert_allclose(turn, [37.0, 45.0, 125.0], atol=0.05)


@pytest.mark.parametrize("roll_deg", [None, (120.0, 180.0)])
def test_random_starts_are_far_and_see_everything_at_both_ends(
    scene: Scene, roll_deg: tuple[float, float] | None
) -> None:
    for seed in range(5):
        start = Scene.drawn(
            scene.arm, scene.camera, scene.marks, np.random.default_rng(seed), roll_deg
        )
        T_start = start.arm.forward_kinematics(start.q_start)
        for T in (T_start, start.T_world_goal):
            assert start.camera.contains(start.seen_px(T), END_MARGIN_PX).all()
        motion = start.problem().T_goal_start
        turn = np.linalg.norm(so3_log(np.ascontiguousarray(motion[:3, :3])))
        assert np.linalg.norm(motion[:3, 3]) > 0.3 or turn > np.radians(60)
        assert not start.arm.outside(start.q_start).any()
        again = Scene.drawn(
            scene.arm, scene.camera, scene.marks, np.random.default_rng(seed), roll_deg
        )
        np.testing.assert_array_equal(again.q_start, start.q_start)


@pytest.mark.parametrize("law", CLASSICAL.values())
def test_classical_laws_arrive_from_close_by(near: Scene, law: object) -> None:
    motion = loop_of(near).run(near.q_start, law(near), 30.0, np.random.default_rng(0))
    assert motion.ending is Ending.ARRIVED
    assert motion.error_px[-1] < ARRIVED_PX
    assert motion.error_px[0] > 10.0


def test_position_based_servoing_goes_straight_in_space(near: Scene) -> None:
    motion = loop_of(near).run(near.q_start, position_based(near), 30.0, np.random.default_rng(0))
    places = np.array([near.arm.forward_kinematics(q)[:3, 3] for q in motion.q])
    way = near.T_world_goal[:3, 3] - places[0]
    off = np.cross(places - places[0], way / np.linalg.norm(way))
    assert np.linalg.norm(off, axis=1).max() < 0.02 * np.linalg.norm(way)


def test_servoing_on_the_object_moves_it_straight_in_the_camera(near: Scene) -> None:
    steer = position_based_on_object(near)
    motion = loop_of(near).run(near.q_start, steer, 30.0, np.random.default_rng(0))
    middle = near.points_world.mean(axis=0, keepdims=True)
    seen = [
        transform_points(se3_inverse(near.arm.forward_kinematics(q)), middle)[0] for q in motion.q
    ]
    way = seen[-1] - seen[0]
    off = np.cross(np.array(seen) - seen[0], way / np.linalg.norm(way))
    assert np.linalg.norm(off, axis=1).max() < 0.05 * np.linalg.norm(way)


def test_the_loop_ends_where_a_point_leaves_the_image(scene: Scene) -> None:
    spin = np.array([0.0, 0.0, 0.0, 0.0, 0.5, 0.0])
    loop = loop_of(scene)
    motion = loop.run(scene.q_start, lambda *_: spin, 20.0, np.random.default_rng(0))
    assert motion.ending is Ending.VIEW
    inside = [scene.camera.contains(px).all() for px in motion.points_px]
    assert all(inside[:-1])
    assert not inside[-1]


def test_the_loop_ends_at_a_joint_limit(scene: Scene) -> None:
    down = np.array([0.0, 0.0, 0.0, 0.0, -0.1, 0.0])
    motion = loop_of(scene).run(scene.q_start, lambda *_: down, 9.0, np.random.default_rng(0))
    assert motion.ending is Ending.JOINT
    assert "joint5" in motion.reason
    assert not scene.arm.outside(motion.q[-2]).any()


def test_the_loop_gives_up_in_time(scene: Scene) -> None:
    motion = loop_of(scene).run(
        scene.q_start, lambda *_: np.zeros(6), 2.0, np.random.default_rng(0)
    )
    assert motion.ending is Ending.SHORT
    assert motion.duration == pytest.approx(2.0, abs=PERIOD)


def test_a_joint_is_too_close_before_it_is_at_its_limit(scene: Scene) -> None:
    close = too_close(scene.arm, scene.q_start)
    q = scene.q_start.copy()
    assert not close(q)
    q[4] = scene.arm.q_min[4] + 1e-3
    assert close(q)
    assert not too_close(scene.arm, q)(q)


def test_plan_between_images_ends_where_the_desired_one_was_taken(scene: Scene) -> None:
    belief = Belief(scene.camera)
    path = plan_between_images(scene, "optimised", belief, np.random.default_rng(0))
    assert isinstance(path, PlannedPath)
    np.testing.assert_allclose(path.T_world_camera[-1], scene.T_world_goal, atol=1e-4)
    np.testing.assert_allclose(path.points_px[-1], scene.goal_px, atol=0.05)


@pytest.mark.parametrize("method", METHODS)
def test_only_planned_servoing_arrives_in_section_6(scene: Scene, method: Method) -> None:
    motion = servo(scene, method, Belief(scene.camera, noise_px=0.3), np.random.default_rng(0))
    assert (motion.ending is Ending.ARRIVED) == (method in ("potential_field", "optimised"))
    assert bool(motion.reason) == (motion.ending is not Ending.ARRIVED)


def test_wrong_beliefs_keep_their_ranges(scene: Scene) -> None:
    random = np.random.default_rng(0)
    beliefs = [Belief.perturbed(scene.camera, 0.3, random) for _ in range(200)]
    focal = np.array([belief.camera.fx / scene.camera.fx for belief in beliefs])
    centre = np.array([belief.camera.cy - scene.camera.cy for belief in beliefs])
    distance = np.array([belief.distance_scale for belief in beliefs])
    for values, middle, half in ((focal, 1.0, 0.05), (centre, 0.0, 15.0), (distance, 1.0, 0.2)):
        assert np.abs(values - middle).max() <= half
        assert np.abs(values - middle).max() > 0.9 * half


def test_only_a_proof_makes_a_start_infeasible(scene: Scene) -> None:
    trial = try_start(scene, None, 18)  # joint 5 is in every way
    assert trial.infeasible
    assert all(end.ending is not Ending.ARRIVED for end in trial.ends.values())
    assert not is_infeasible(scene)


def test_success_counts_feasible_starts_only() -> None:
    arrived, lost = End(Ending.ARRIVED, "", 1), End(Ending.VIEW, "mark 1", 1)
    trials = [
        Trial({"optimised": arrived}, False),
        Trial({"optimised": lost}, False),
        Trial({"optimised": lost}, True),
    ]
    assert success_rate(trials, "optimised") == 0.5


def test_processes_give_the_same_answers_in_the_same_order(scene: Scene) -> None:
    with Workers(1) as this, Workers(2) as others:
        alone = wrong_beliefs(scene, 3, this)
        together = wrong_beliefs(scene, 3, others)
    assert alone == together


def test_a_turn_about_the_optical_axis_alone_is_refused_with_the_reason(scene: Scene) -> None:
    roll = se3(so3_exp(np.array([0.0, 0.0, 0.5])), np.zeros(3))
    goal = scene.arm.forward_kinematics(scene.q_start) @ roll
    turned = replace(scene, T_world_goal=goal)
    plan = plan_between_images(turned, "optimised", Belief(scene.camera), np.random.default_rng(0))
    assert isinstance(plan, str)
    assert "translation" in plan


def test_every_check_of_the_study_holds_on_projections(tmp_path: Path) -> None:
    shares = []
    result = reproduce(
        tmp_path,
        True,
        lambda _what, share: shares.append(share),
        counts={"random": 3, "random_roll": 2, "perturbed": 2, "joined": 20},
        workers=1,
    )
    assert {check.name for check in result.checks} == CHECKS
    assert [check.name for check in result.checks if not check.holds] == []
    assert shares == sorted(shares)
    assert all(figure.path.stat().st_size > 5000 for figure in result.figures)


def test_the_printed_plus_is_right_along_the_axis_alone() -> None:
    upsilon = np.array([0.3, -0.2, 0.1, 0.4, -0.9, 1.2])
    for step in 1e-5 * np.eye(6):
        R, after = so3_exp(upsilon[3:]), so3_exp((upsilon + step)[3:])
        moved = np.concatenate((R.T @ step[:3], so3_log(R.T @ after)))
        np.testing.assert_allclose(twist_of(upsilon, step, -1.0), moved, atol=1e-9)
    across = np.cross(upsilon[3:], [1.0, 0.0, 0.0])
    for way, alike in ((upsilon[3:], True), (across, False)):
        step = 1e-5 * np.concatenate((np.zeros(3), way))
        plus, minus = (twist_of(upsilon, step, sign) for sign in (1.0, -1.0))
        assert np.allclose(plus, minus, atol=1e-9) == alike
