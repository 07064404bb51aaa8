"""The planner of the paper."""

from dataclasses import replace

import numpy as np
import pytest
from gantry_cell import gantry, section6

from vergence.arrays import FloatArray
from vergence.geometry import se3_inverse, so3_exp, so3_log, transform_points
from vergence.planning.failure import Obstacle
from vergence.planning.field import (
    Field,
    image_at,
    image_barrier,
    joint_barrier,
    parameter_jacobian,
    printed_joint_barrier,
    repulsion,
)
from vergence.planning.path import Path
from vergence.planning.potential_field import PotentialFieldPlanner

STRAIGHT = PotentialFieldPlanner(gain_image=0.0, gain_joint=0.0)


def make_field(seed: int, gain_image: float = 1.0, gain_joint: float = 0.0) -> Field:
    random = np.random.default_rng(seed)
    m_star = random.uniform(-0.3, 0.3, (5, 2))
    return Field(
        m_star=m_star,
        normal=np.array([0.1, -0.2, 0.97]) / np.linalg.norm([0.1, -0.2, 0.97]),
        delta=random.uniform(-0.1, 0.1, 5),
        distance=0.7,
        T_world_star=np.eye(4),
        bounds=np.array([-0.44, 0.45, -0.33, 0.34]),
        image_zone=np.array([0.3, 0.31, 0.32, 0.33]),
        q_min=gantry().q_min.copy(),
        q_max=gantry().q_max.copy(),
        joint_zone=np.full(6, 0.6),
        gain_image=gain_image,
        gain_joint=gain_joint,
        printed=False,
    )


@pytest.mark.parametrize("angle", [1e-4, 0.7, 3.0, 4.5])
def test_parameter_jacobian_maps_rates_of_upsilon_to_the_camera_twist(angle: float) -> None:
    upsilon = np.array([0.3, -0.5, 0.2, *(angle * np.array([0.36, 0.48, 0.8]))])
    h, distance = 1e-6, 0.7
    M = parameter_jacobian(upsilon, distance)
    for k in range(6):
        after, before = upsilon + h * np.eye(6)[k], upsilon - h * np.eye(6)[k]
        R = so3_exp(upsilon[3:])
        v = R.T @ (after - before)[:3] * distance / (2 * h)
        turn = so3_log(so3_exp(before[3:]).T @ so3_exp(after[3:])) / (2 * h)
        np.testing.assert_allclose(M[:, k], [*v, *turn], atol=1e-7)


def test_printed_sign_of_the_rotation_jacobian_would_be_wrong() -> None:
    upsilon = np.array([0.0, 0.0, 0.0, 0.3, -0.8, 1.1])
    theta, u = np.linalg.norm(upsilon[3:]), upsilon[3:] / np.linalg.norm(upsilon[3:])
    cross = np.array([[0, -u[2], u[1]], [u[2], 0, -u[0]], [-u[1], u[0], 0]])
    half_sinc2 = (theta / 2) * (np.sin(theta / 2) / (theta / 2)) ** 2
    rest = np.eye(3) + (1 - np.sin(theta) / theta) * cross @ cross
    ours = parameter_jacobian(upsilon, 1.0)[3:, 3:]
    np.testing.assert_allclose(ours, rest - half_sinc2 * cross, atol=1e-12)
    assert np.abs(ours - (rest + half_sinc2 * cross)).max() > 0.5


def test_image_of_upsilon_is_the_projection_of_the_points() -> None:
    field = make_field(1)
    upsilon = np.array([0.1, -0.2, -0.3, 0.2, -0.1, 0.9])
    m, rho = image_at(field, upsilon)
    rays = np.column_stack((field.m_star, np.ones(5)))
    points_star = field.distance * rays / (rays @ field.normal - field.delta)[:, None]
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = so3_exp(upsilon[3:]), field.distance * upsilon[:3]
    points = transform_points(se3_inverse(T), points_star)
    np.testing.assert_allclose(m, points[:, :2] / points[:, 2:], atol=1e-12)
    np.testing.assert_allclose(field.distance * rho, points[:, 2], atol=1e-12)


def test_image_barrier_gradient_is_its_derivative() -> None:
    field, h = make_field(2), 1e-7
    m = field.m_star.copy()
    _, gradient = image_barrier(field, m)
    assert np.abs(gradient).max() > 0
    for k in range(10):
        step = (h * np.eye(10)[k]).reshape(5, 2)
        change = image_barrier(field, m + step)[0] - image_barrier(field, m - step)[0]
        assert gradient[k] == pytest.approx(change / (2 * h), rel=1e-5, abs=1e-5)


def test_the_printed_joint_barrier_is_the_papers_sum_once_a_joint_is_in_its_zone() -> None:
    # One joint at 0.5 of ±1: 1/((1 - 0.5)(1 + 0.5)) = 4/3, slope 2q/(1 - q²)² = 16/9; the other in
    # the middle of -2 … 1: 1/((1 + 0.5)(1 - 0.25)) = 8/9 and slope 0.
    low, high = np.array([-1.0, -2.0]), np.array([1.0, 1.0])
    field = make_field(0)._replace(q_min=low, q_max=high, joint_zone=np.full(2, 0.6))
    value, gradient = printed_joint_barrier(field, np.array([0.5, -0.5]))
    assert value == pytest.approx(4 / 3 + 8 / 9)
    np.testing.assert_allclose(gradient, [16 / 9, 0.0], atol=1e-12)
    value, gradient = printed_joint_barrier(field, np.array([0.39, -0.5]))  # both acceptable
    assert value == 0.0
    assert not gradient.any()


def test_the_printed_joint_barrier_is_refused_for_limits_on_one_side_of_zero() -> None:
    problem = section6()
    aside = replace(problem, arm=replace(problem.arm, q_min=np.append(problem.arm.q_min[:5], 0.1)))
    plan = PotentialFieldPlanner(joint_potential="printed").plan(aside)
    assert not plan
    assert "needs limits on both sides of 0" in str(plan)


def test_with_the_printed_joint_barrier_the_paths_joints_keep_off_their_limits() -> None:
    free = PotentialFieldPlanner(gain_joint=0.0).walk(section6())
    held = PotentialFieldPlanner(gain_joint=0.05, joint_potential="printed").walk(section6())
    assert free.joint_margin < 0.0
    assert held.joint_margin > 0.0


def test_joint_barrier_gradient_is_its_derivative_and_zero_at_the_border() -> None:
    field, h = make_field(3), 1e-7
    q = 0.5 * (field.q_min + field.q_max) + 0.38 * (field.q_max - field.q_min)
    _, gradient = joint_barrier(field, q)
    for k in range(6):
        step = h * np.eye(6)[k]
        change = joint_barrier(field, q + step)[0] - joint_barrier(field, q - step)[0]
        assert gradient[k] == pytest.approx(change / (2 * h), rel=1e-5)
    border = 0.5 * (field.q_min + field.q_max) + 0.2 * (field.q_max - field.q_min)
    value, gradient = joint_barrier(field, border + 1e-9)
    assert value < 1e-12
    assert np.abs(gradient).max() < 1e-6


def test_repulsion_is_the_derivative_of_the_image_potential_by_upsilon() -> None:
    field = make_field(4)
    upsilon, h = np.array([0.05, -0.04, -0.1, 0.05, -0.1, 0.3]), 1e-6

    def potential(at: FloatArray) -> float:
        return float(image_barrier(field, image_at(field, at)[0])[0])

    m, rho = image_at(field, upsilon)
    force = repulsion(field, gantry().chain, upsilon, np.zeros(6), m, rho)
    for k in range(6):
        step = h * np.eye(6)[k]
        slope = (potential(upsilon + step) - potential(upsilon - step)) / (2 * h)
        assert force[k] == pytest.approx(-slope, rel=1e-4, abs=1e-6)


def reached(path: Path) -> bool:
    return bool(np.allclose(path.T_world_camera[-1], path.problem.T_world_goal, atol=1e-6))


def test_joints_follow_the_camera_without_drift() -> None:
    path = PotentialFieldPlanner().walk(section6())
    for q, T in zip(path.q, path.T_world_camera, strict=True):
        np.testing.assert_allclose(gantry().forward_kinematics(q), T, atol=1e-6)


def test_straight_path_leaves_the_view_and_passes_the_limit_of_joint_5() -> None:
    path = STRAIGHT.walk(section6())
    assert reached(path)
    assert path.image_margin_px < -50
    worst = np.abs(path.joints_normalized).max(axis=0)
    assert worst[4] > 1.05
    assert (np.delete(worst, 4) < 1).all()
    centres = path.T_world_camera[:, :3, 3]
    line = centres[-1] - centres[0]
    off = np.linalg.norm(np.cross(centres - centres[0], line), axis=1) / np.linalg.norm(line)
    assert off.max() < 1e-9


def test_visibility_alone_keeps_the_view_but_not_joint_5() -> None:
    path = PotentialFieldPlanner(gain_joint=0.0).walk(section6())
    assert reached(path)
    assert path.in_view().all()
    assert np.abs(path.joints_normalized).max(axis=0)[4] > 1.05


def test_both_potentials_keep_every_constraint() -> None:
    path = PotentialFieldPlanner().plan(section6())
    assert isinstance(path, Path)
    assert reached(path)
    assert path.image_margin_px > 20
    assert path.joint_margin > 0.05


def test_path_of_images_is_what_the_camera_would_see() -> None:
    path = PotentialFieldPlanner().walk(section6())
    again = Path.through(path.problem, path.q, "again")
    np.testing.assert_allclose(path.points_px, again.points_px, atol=1e-3)
    np.testing.assert_allclose(path.depth_m, again.depth_m, atol=1e-6)


def test_path_that_breaks_a_constraint_is_a_failure_that_names_it() -> None:
    failure = STRAIGHT.plan(section6())
    assert not failure
    assert failure.obstacle is Obstacle.JOINT_LIMIT
    assert "joint5" in failure.reason


def test_long_way_turns_the_other_way_round() -> None:
    path = STRAIGHT.walk(section6(), long_way=True)
    assert reached(path)
    short = STRAIGHT.walk(section6())
    middle = [p.T_world_camera[len(p.q) // 2, :3, :3] for p in (path, short)]
    assert np.linalg.norm(so3_log(middle[0].T @ middle[1])) > 1.5
