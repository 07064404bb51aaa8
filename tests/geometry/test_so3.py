import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vergence.geometry import (
    angle_between,
    matrix_to_quaternion,
    matrix_to_rpy,
    quaternion_to_matrix,
    rpy_rates_to_omega,
    rpy_to_matrix,
    skew,
    so3_angle,
    so3_exp,
    so3_left_jacobian,
    so3_left_jacobian_inverse,
    so3_log,
)

# Where rotations hurt: nothing, denormal, below and above the switch to the series, half a turn.
ANGLES = [0.0, 1e-200, 1e-12, 1e-7, 1e-4, 0.0999999, 0.1000001, 1.0, 3.0]
NEAR_HALF_TURN = [np.pi - 1e-3, np.pi - 1e-8, np.pi - 1e-12]


def axes(count: int) -> np.ndarray:
    rng = np.random.default_rng(4)
    sampled = rng.standard_normal((count, 3))
    sampled /= np.linalg.norm(sampled, axis=1)[:, None]
    return np.vstack((np.eye(3), -np.eye(3), sampled))


@pytest.mark.parametrize("angle", ANGLES + NEAR_HALF_TURN)
def test_log_inverts_exp(angle):
    for axis in axes(20):
        w = angle * axis
        np.testing.assert_allclose(so3_log(so3_exp(w)), w, rtol=1e-13, atol=2e-15)


def test_log_of_exactly_half_a_turn_is_one_of_the_two_axes():
    for axis in axes(20):
        R = 2.0 * np.outer(axis, axis) - np.eye(3)
        w = so3_log(R)
        assert np.linalg.norm(w) == pytest.approx(np.pi, abs=1e-14)
        np.testing.assert_allclose(so3_exp(w), R, atol=1e-14)


@settings(deadline=None)  # the first call compiles
@given(st.lists(st.floats(-10.0, 10.0), min_size=3, max_size=3))
def test_exp_is_a_rotation_and_log_stays_within_half_a_turn(values):
    w = np.array(values)
    R = so3_exp(w)
    np.testing.assert_allclose(R @ R.T, np.eye(3), atol=1e-13)
    assert np.linalg.det(R) > 0.0
    assert np.linalg.norm(so3_log(R)) <= np.pi + 1e-15
    np.testing.assert_allclose(so3_exp(so3_log(R)), R, atol=1e-13)


def test_exp_agrees_with_the_power_series():
    for axis in axes(5):
        S = skew(0.3 * axis)
        total, term = np.eye(3), np.eye(3)
        for k in range(1, 20):
            term = term @ S / k
            total = total + term
        np.testing.assert_allclose(so3_exp(0.3 * axis), total, atol=1e-15)


def test_skew_is_the_cross_product():
    rng = np.random.default_rng(1)
    a, b = rng.standard_normal((2, 3))
    np.testing.assert_allclose(skew(a) @ b, np.cross(a, b), atol=1e-15)


@pytest.mark.parametrize("angle", [*ANGLES, *NEAR_HALF_TURN, 4.0])
def test_left_jacobian_is_the_derivative_of_exp(angle):
    step = 1e-6
    for axis in axes(4):
        w = angle * axis
        R = so3_exp(w)
        J = np.empty((3, 3))
        for i, d in enumerate(np.eye(3) * step):
            J[:, i] = (so3_log(so3_exp(w + d) @ R.T) - so3_log(so3_exp(w - d) @ R.T)) / (2 * step)
        np.testing.assert_allclose(so3_left_jacobian(w), J, atol=2e-9)


@pytest.mark.parametrize("angle", [*ANGLES, *NEAR_HALF_TURN, 5.0])
def test_left_jacobian_inverse_is_the_inverse(angle):
    for axis in axes(10):
        product = so3_left_jacobian(angle * axis) @ so3_left_jacobian_inverse(angle * axis)
        np.testing.assert_allclose(product, np.eye(3), atol=1e-13)


def test_left_jacobian_carries_w_to_itself_at_the_edge_of_the_series():
    for angle in (0.1 - 1e-9, 0.1 + 1e-9):
        w = angle * axes(1)[-1]
        np.testing.assert_allclose(so3_left_jacobian(w) @ w, w, atol=1e-16)
        np.testing.assert_allclose(so3_left_jacobian(w) @ so3_exp(-w), so3_left_jacobian(-w))


@pytest.mark.parametrize("angle", ANGLES + NEAR_HALF_TURN)
def test_quaternion_and_matrix_invert_each_other(angle):
    for axis in axes(10):
        R = so3_exp(angle * axis)
        q = matrix_to_quaternion(R)
        assert q[0] >= 0.0
        assert np.linalg.norm(q) == pytest.approx(1.0, abs=1e-15)
        np.testing.assert_allclose(quaternion_to_matrix(q), R, atol=5e-16 * 4)


@settings(deadline=None)  # the first call compiles
@given(st.floats(-3.1, 3.1), st.floats(-1.56, 1.56), st.floats(-3.1, 3.1))
def test_rpy_comes_back_from_its_matrix(phi, theta, psi):
    rpy = np.array([phi, theta, psi])
    np.testing.assert_allclose(matrix_to_rpy(rpy_to_matrix(rpy)), rpy, atol=1e-12)


@pytest.mark.parametrize("theta", [np.pi / 2, -np.pi / 2])
def test_rpy_at_the_singular_pitch_still_names_the_rotation(theta):
    R = rpy_to_matrix(np.array([0.7, theta, -0.4]))
    np.testing.assert_allclose(rpy_to_matrix(matrix_to_rpy(R)), R, atol=1e-15)


def test_rpy_is_roll_about_z_pitch_about_y_yaw_about_x():
    rpy = np.array([0.3, -0.8, 1.4])
    expected = (
        so3_exp(np.array([0.0, 0.0, 0.3]))
        @ so3_exp(np.array([0.0, -0.8, 0.0]))
        @ so3_exp(np.array([1.4, 0.0, 0.0]))
    )
    np.testing.assert_allclose(rpy_to_matrix(rpy), expected, atol=1e-15)


def test_rpy_rates_give_the_angular_velocity():
    rng = np.random.default_rng(2)
    step = 1e-6
    for rpy in rng.uniform(-1.5, 1.5, (10, 3)):
        rates = rng.standard_normal(3)
        ahead, behind = rpy_to_matrix(rpy + step * rates), rpy_to_matrix(rpy - step * rates)
        omega = so3_log(ahead @ behind.T) / (2 * step)
        np.testing.assert_allclose(rpy_rates_to_omega(rpy) @ rates, omega, atol=1e-8)
        assert np.linalg.det(rpy_rates_to_omega(rpy)) == pytest.approx(-np.cos(rpy[1]))


@pytest.mark.parametrize("angle", ANGLES + NEAR_HALF_TURN)
def test_the_angle_between_orientations_is_that_of_the_turn_between_them(angle):
    R = so3_exp(np.array([0.4, -1.1, 0.3]))
    for axis in axes(5):
        turn = so3_exp(angle * axis)
        assert so3_angle(turn) == pytest.approx(angle, abs=1e-12)
        for other in (R @ turn, turn @ R):
            assert angle_between(R, other) == pytest.approx(angle, abs=1e-12)
            assert angle_between(other, R) == pytest.approx(angle, abs=1e-12)


def test_the_angle_of_a_pose_is_that_of_its_rotation_in_any_memory():
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = so3_exp(np.array([0.0, 0.7, 0.0])), 5.0
    T.flags.writeable = False
    for pose in (T, np.asfortranarray(T), T[:3, :3]):
        assert so3_angle(pose) == pytest.approx(0.7)
        assert angle_between(pose, np.eye(4)) == pytest.approx(0.7)
