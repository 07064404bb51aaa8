"""An arm walked backwards: the fixed camera as the hand sees it."""

import numpy as np
import pytest

from vergence.cell import load_cell
from vergence.features import interaction_matrix_points
from vergence.geometry import se3, so3_exp, transform_points
from vergence.robot import reverse_arm
from vergence.simulation import SimulatedDriver


@pytest.fixture(scope="module", params=["puma560", "lippiello2005", "gantry"])
def arm(request):
    driver = SimulatedDriver(load_cell(request.param), images=False)
    return driver.world.arm_to_body(driver.cell.task.arm)


def poses(rng):
    return se3(so3_exp(rng.normal(size=3)), rng.normal(size=3))


def test_its_tip_is_the_camera_in_the_hands_frame(arm):
    rng = np.random.default_rng(0)
    for _ in range(20):
        T_world_camera, q = poses(rng), rng.uniform(-2, 2, arm.joint_count)
        backwards = reverse_arm(arm, T_world_camera)
        T = np.linalg.inv(arm.forward_kinematics(q)) @ T_world_camera
        np.testing.assert_allclose(backwards.forward_kinematics(q[::-1]), T, atol=1e-12)


def test_walked_backwards_twice_it_is_itself(arm):
    rng = np.random.default_rng(1)
    q = rng.uniform(-2, 2, arm.joint_count)
    twice = reverse_arm(reverse_arm(arm, np.eye(4)), np.eye(4))
    np.testing.assert_allclose(twice.forward_kinematics(q), arm.forward_kinematics(q), atol=1e-12)
    assert twice.names == arm.names
    np.testing.assert_array_equal(twice.q_min, arm.q_min)


def test_its_jacobian_moves_what_the_hand_holds_in_the_picture(arm):
    rng = np.random.default_rng(2)
    q = rng.uniform(-1, 1, arm.joint_count)
    T_hand_camera = se3(so3_exp(rng.normal(size=3)), rng.normal(size=3))
    T_world_camera = arm.forward_kinematics(q) @ T_hand_camera
    seen = np.array([[0.1, -0.05, 1.0], [-0.1, 0.1, 1.3]])
    held = transform_points(T_hand_camera, seen)

    def picture(q):
        T = np.linalg.inv(T_world_camera) @ arm.forward_kinematics(q)
        points = transform_points(np.ascontiguousarray(T), held)
        return (points[:, :2] / points[:, 2:]).ravel()

    J = reverse_arm(arm, T_world_camera).jacobian(q[::-1])[:, ::-1]
    moved = interaction_matrix_points(seen[:, :2] / seen[:, 2:], seen[:, 2]) @ J
    step = 1e-6 * np.eye(arm.joint_count)
    numeric = np.array([(picture(q + e) - picture(q - e)) / 2e-6 for e in step]).T
    np.testing.assert_allclose(moved, numeric, atol=1e-8)
