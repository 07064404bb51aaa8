"""The corners of an estimated target, as the constraints of a following hand see them."""

import numpy as np
import pytest

from vergence.cell import load_cell
from vergence.control import (
    CameraMounting,
    MovingPose,
    PoseServo,
    PositionBased,
    Situation,
    TargetView,
    moved,
)
from vergence.control.limits._rows import DEPTH, X_FLOW, X_SPREAD, X
from vergence.control.limits.target_view import pose_features
from vergence.geometry import se3_compose, se3_exp, se3_inverse, transform_points
from vergence.signals import JointState, Observation, Reference, TargetState
from vergence.simulation import SimulatedDriver

CORNERS = 0.05 * np.array([[1.0, 1, 1], [-1, 1, 0], [-1, -1, 1], [1, -1, -1]])
DESIRED = np.array([[0.0, -1, 0, 0], [-1, 0, 0, 0], [0, 0, -1, 0.4], [0, 0, 0, 1]])


@pytest.fixture(scope="module")
def scene():
    driver = SimulatedDriver(load_cell("lippiello2005"), images=False)
    q = driver.world.joint_position("slave")
    arm = driver.arms["slave"]
    return arm, driver.cameras["hand"], q, se3_compose(arm.forward_kinematics(q), DESIRED)


def camera_world(arm, q):
    return se3_inverse(arm.forward_kinematics(q))


def image(arm, q, T_target):
    points = transform_points(se3_inverse(arm.forward_kinematics(q)) @ T_target, CORNERS)
    return points[:, :2] / points[:, 2:], points[:, 2]


def test_corners_move_in_the_image_as_the_pose_does(scene):
    arm, _, q, T = scene
    twist = np.array([0.05, -0.1, 0.2, 0.5, -0.3, 0.4])
    features = pose_features(camera_world(arm, q), T, twist, CORNERS, np.zeros((6, 6)))
    points, depth = image(arm, q, T)
    np.testing.assert_allclose(features[:, X : X + 2], points, atol=1e-12)
    np.testing.assert_allclose(features[:, DEPTH], depth, atol=1e-12)
    after, before = (image(arm, q, moved(MovingPose(T, twist), dt))[0] for dt in (1e-6, -1e-6))
    flow = features[:, X_FLOW : X_FLOW + 2]
    np.testing.assert_allclose(flow, (after - before) / 2e-6, atol=1e-7)


def test_the_spread_of_corners_is_that_of_poses_drawn_from_the_covariance(scene):
    arm, _, q, T = scene
    rng = np.random.default_rng(3)
    root = rng.normal(size=(6, 6)) * np.repeat([1e-3, 3e-3], 3)[:, None]
    features = pose_features(camera_world(arm, q), T, np.zeros(6), CORNERS, root @ root.T)
    offs = (root @ rng.normal(size=(6, 4000))).T
    drawn = [image(arm, q, moved(MovingPose(T, off), 1.0))[0] for off in offs]
    expected = 2.0 * np.std(drawn, axis=0)
    np.testing.assert_allclose(features[:, X_SPREAD : X_SPREAD + 2], expected, rtol=0.05)


def test_a_corner_behind_the_camera_is_no_constraint_and_no_number_out_of_bounds(scene):
    arm, camera, q, _ = scene
    behind = se3_compose(arm.forward_kinematics(q), se3_exp(np.array([0, 0, -0.5, 0, 0, 0])))
    features = pose_features(camera_world(arm, q), behind, np.zeros(6), CORNERS, np.eye(6))
    np.testing.assert_array_equal(features, 0.0)
    servo = PoseServo(
        arm, CameraMounting(camera), PositionBased(), corners=CORNERS, situation=Situation(2e-3)
    )
    state = TargetState(0.0, behind, np.zeros(6), np.eye(12), True)
    reference = Reference(0.0, T_camera_target=DESIRED)
    joints = JointState(0.0, q, 0 * q)
    command = servo.command(Observation(0.0, (), state), reference, joints)
    assert command.active != ("no solution: braking",)
    assert np.isfinite(command.velocity).all()


def test_corners_that_the_desired_pose_does_not_show_are_left_out(scene):
    arm, camera, q, T = scene
    x_min, x_max, y_min, y_max = camera.rectangle(10.5)
    low, high = np.array([x_min, y_min]), np.array([x_max, y_max])
    view = TargetView(CameraMounting(camera), CORNERS, low, high)
    near = DESIRED.copy()
    near[0, 3] = 0.1  # so far to the right that some corners are beyond the border
    view.see(TargetState(0.0, T, np.zeros(6), np.zeros((12, 12)), True), near, 0.0)
    assert 0 < len(view.features(arm.forward_kinematics(q))) < len(CORNERS)
