from itertools import pairwise

import numpy as np
import pytest

from vergence.geometry import (
    moved_pose,
    pose_difference,
    se3,
    se3_adjoint,
    se3_compose,
    se3_distance,
    se3_exp,
    se3_inverse,
    se3_log,
    so3_exp,
    transform_points,
)


def twists(count: int) -> np.ndarray:
    """Sampled twists, with pure translations, pure rotations and angles near 0 and π."""
    rng = np.random.default_rng(7)
    sampled = rng.uniform(-2.0, 2.0, (count, 6))
    for n, angle in enumerate((0.0, 1e-9, 1e-4, 0.1, np.pi - 1e-7)):
        sampled[n, 3:] *= angle / np.linalg.norm(sampled[n, 3:])
    sampled[5, :3] = 0.0
    sampled[6:, 3:] *= 0.8
    return sampled


def test_log_inverts_exp():
    for twist in twists(40):
        np.testing.assert_allclose(se3_log(se3_exp(twist)), twist, atol=1e-13)


def test_exp_follows_the_flow_of_a_constant_twist():
    for twist in twists(8):
        tenth = se3_exp(twist / 10)
        np.testing.assert_allclose(np.linalg.matrix_power(tenth, 10), se3_exp(twist), atol=1e-13)


def test_inverse_undoes():
    for twist in twists(10):
        T = se3_exp(twist)
        np.testing.assert_allclose(se3_inverse(T) @ T, np.eye(4), atol=1e-14)
        np.testing.assert_allclose(se3_inverse(T), se3_exp(-twist), atol=1e-14)


def test_compose_is_the_matrix_product():
    first, second = (se3_exp(twist) for twist in twists(8)[-2:])
    np.testing.assert_allclose(se3_compose(first, second), first @ second, atol=1e-14)


def test_adjoint_conjugates_the_exponential():
    T = se3_exp(twists(12)[-1])
    for twist in twists(10):
        moved = se3_exp(se3_adjoint(T) @ (0.3 * twist))
        np.testing.assert_allclose(moved, T @ se3_exp(0.3 * twist) @ se3_inverse(T), atol=1e-13)


def test_adjoint_is_a_homomorphism():
    first, second = (se3_exp(twist) for twist in twists(8)[-2:])
    np.testing.assert_allclose(
        se3_adjoint(first) @ se3_adjoint(second), se3_adjoint(first @ second), atol=1e-13
    )


def test_points_transform_as_homogeneous_coordinates():
    rng = np.random.default_rng(3)
    points = rng.standard_normal((6, 3))
    T = se3_exp(twists(9)[-1])
    expected = (T @ np.column_stack((points, np.ones(6))).T).T[:, :3]
    np.testing.assert_allclose(transform_points(T, points), expected, atol=1e-14)
    np.testing.assert_allclose(transform_points(se3_inverse(T), expected), points, atol=1e-14)


def test_points_may_be_a_strided_read_only_view():
    block = np.arange(24.0).reshape(4, 6)
    block.flags.writeable = False
    np.testing.assert_array_equal(transform_points(np.eye(4), block[:, ::2]), block[:, ::2])


def test_distance_weighs_angle_by_length():
    T_a = se3_exp(twists(7)[-1])
    w = np.array([0.0, 0.6, 0.8]) * 0.5
    T_b = T_a @ se3(so3_exp(w), np.array([0.3, 0.0, 0.4]))
    assert se3_distance(T_a, T_b, 2.0) == pytest.approx(np.hypot(0.5, 1.0), abs=1e-13)
    assert se3_distance(T_a, T_a, 2.0) == pytest.approx(0.0, abs=1e-7)
    assert se3_distance(T_a, T_b, 2.0) == pytest.approx(se3_distance(T_b, T_a, 2.0))


def test_a_pose_moved_by_its_difference_to_another_is_the_other():
    poses = [se3_exp(twist) for twist in twists(20)]
    for T_from, T_to in pairwise(poses):
        step = pose_difference(T_to, T_from)
        np.testing.assert_allclose(moved_pose(T_from, step), T_to, atol=1e-13)
        np.testing.assert_allclose(pose_difference(T_from, T_to), -step, atol=1e-13)


def test_a_step_moves_and_turns_about_the_axes_of_the_frame_the_pose_is_in():
    T, step = se3_exp(twists(12)[-1]), np.array([0.1, -0.2, 0.3, 0.02, 0.5, -0.1])
    moved = moved_pose(T, step)
    np.testing.assert_allclose(moved[:3, 3], T[:3, 3] + step[:3], atol=1e-15)
    np.testing.assert_allclose(moved[:3, :3], so3_exp(step[3:]) @ T[:3, :3], atol=1e-15)
    np.testing.assert_array_equal(moved[3], [0.0, 0.0, 0.0, 1.0])
