"""A camera is kept in front of a flat target, as far as its features and depths say it is flat."""

import numpy as np
import pytest

from vergence.arrays import FloatArray
from vergence.cell import load_cell
from vergence.control import ImageBased, Limits, Servo
from vergence.control.limits import facing_rows, flat_face, pack_features
from vergence.features import Points
from vergence.geometry import se3, so3_exp, transform_points
from vergence.robot import Arm
from vergence.simulation import SimulatedDriver

SQUARE = np.array([[0.05, 0.05, 0.0], [-0.05, 0.05, 0.0], [-0.05, -0.05, 0.0], [0.05, -0.05, 0.0]])
T_TILTED = se3(so3_exp(np.array([np.pi - 1.35, 0.1, 0.2])), np.array([0.02, -0.03, 0.6]))


def arm_and_start() -> tuple[Arm, FloatArray]:
    driver = SimulatedDriver(load_cell("puma560"), False)
    return driver.world.arm_to_camera("wrist"), driver.read().joints["puma"].position.copy()


def features_at(arm: Arm, q: FloatArray, T_world_target: FloatArray) -> FloatArray:
    points = transform_points(np.linalg.inv(arm.forward_kinematics(q)) @ T_world_target, SQUARE)
    image = points[:, :2] / points[:, 2:]
    packed: FloatArray = pack_features(image, np.zeros_like(image), points[:, 2].copy())
    return packed


def sine(arm: Arm, q: FloatArray, T_world_target: FloatArray) -> float:
    away = arm.forward_kinematics(q)[:3, 3] - T_world_target[:3, 3]
    return float(abs(T_world_target[:3, 2] @ away) / np.linalg.norm(away))


def test_the_row_is_the_derivative_of_the_sine_at_which_the_target_is_seen() -> None:
    arm, q = arm_and_start()
    T_world_target = arm.forward_kinematics(q) @ T_TILTED
    face = flat_face(features_at(arm, q, T_world_target))
    C, d = facing_rows(face, arm.jacobian(q), 0.1, 2.0)
    h = 1e-6
    for i in range(arm.joint_count):
        step = h * np.eye(arm.joint_count)[i]
        ends = [sine(arm, q + s * step, T_world_target) for s in (1, -1)]
        assert C[0, i] == pytest.approx((ends[0] - ends[1]) / (2 * h), abs=1e-6)
    assert d[0] == pytest.approx(-2.0 * (sine(arm, q, T_world_target) - 0.1))


@pytest.mark.parametrize("depth", [np.array([0.6, 0.7, 0.6, 0.6]), np.zeros(4)])
def test_features_that_are_not_flat_or_not_in_front_have_no_face(depth: FloatArray) -> None:
    arm, q = arm_and_start()
    features = features_at(arm, q, arm.forward_kinematics(q) @ T_TILTED)
    features[:, 4] = depth
    assert flat_face(features).shape == (0, 6)


def test_a_goal_beyond_the_edge_of_a_flat_target_is_not_followed_behind_it() -> None:
    """The desired image is one from behind: the camera stops at the least angle, in front."""
    arm, q = arm_and_start()
    T_world_target = arm.forward_kinematics(q) @ T_TILTED
    T_behind = T_TILTED @ se3(so3_exp(np.array([-0.4, 0.0, 0.0])), np.zeros(3))
    assert T_behind[:3, 2] @ T_behind[:3, 3] > 0
    goal = transform_points(T_behind, SQUARE)
    desired = Points(goal[:, :2] / goal[:, 2:], goal[:, 2].copy())
    camera = SimulatedDriver(load_cell("puma560"), False).cameras["wrist"]
    limits = Limits(facing_deg=5.0, manipulability_share=0.0)
    law = Servo(arm, camera, ImageBased(gain=2.0), limits=limits, depth_m=0.6)
    rates, least = np.zeros(arm.joint_count), np.inf
    for _ in range(300):
        features = features_at(arm, q, T_world_target)
        now = Points(features[:, :2].copy(), features[:, 4].copy())
        rates = law.rates(now, desired, q, rates)
        q = q + rates / 30
        away = arm.forward_kinematics(q)[:3, 3] - T_world_target[:3, 3]
        least = min(least, float(T_world_target[:3, 2] @ away / np.linalg.norm(away)))
    assert least > np.sin(np.radians(4.5))
