"""What stands between a camera and the target."""

import numpy as np
import pytest

from vergence.cell import load_cell
from vergence.estimation import TargetShape, predict_visibility
from vergence.estimation.rig import CameraRig
from vergence.geometry import se3_inverse, transform_points
from vergence.simulation import SimulatedDriver
from vergence.simulation.obstacles import Obstacles
from vergence.vision.known_object import object_model_of


@pytest.fixture(scope="module")
def driver() -> SimulatedDriver:
    return SimulatedDriver(load_cell("four_cameras"), images=False)


def test_a_post_hides_what_lies_behind_it_and_nothing_else(driver: SimulatedDriver) -> None:
    obstacles = Obstacles(driver.world)
    obstacles.move({name: driver.world.joint_position(name) for name in driver.arms})
    eye = np.array([1.10, 1.0, 1.0])  # the post stands at (1.10, 0.42)
    points = np.array([[1.10, 0.2, 1.0], [1.20, 0.2, 1.0], [1.10, 0.6, 1.0]])
    assert obstacles.blocked(eye, points).tolist() == [True, False, False]


def test_the_target_itself_is_no_obstacle(driver: SimulatedDriver) -> None:
    obstacles = Obstacles(driver.world)
    obstacles.move({})
    T = driver.world.target_pose()
    eye = T[:3, 3] + (0.0, 0.0, 0.4)
    assert not obstacles.blocked(eye, T[:3, 3][None] - (0.0, 0.0, 0.2)).any()


def test_an_arm_is_where_its_joints_say(driver: SimulatedDriver) -> None:
    obstacles = Obstacles(driver.world)
    start = driver.world.joint_position("watcher")
    flange = driver.world.arm_to_body("watcher")
    for turn in (0.0, 1.0):
        q = start + np.array([turn, 0, 0, 0, 0, 0])
        obstacles.move({"watcher": q})
        centre = (flange.forward_kinematics(q) @ [0.0, 0.0, -0.03, 1.0])[:3]
        assert obstacles.blocked(centre + (0, 0, 0.5), centre[None] - (0, 0, 0.3)).all()
    obstacles.move({"watcher": start})
    assert not obstacles.blocked(centre + (0, 0, 0.5), centre[None] - (0, 0, 0.1)).any()


def test_predicted_sight_agrees_with_the_true_one(driver: SimulatedDriver) -> None:
    model = object_model_of(driver.world.model, "target")
    shape = TargetShape.from_mesh(model.corners, model.vertices, model.triangles)
    rig = CameraRig.of(driver.cameras, 0.5)
    obstacles = Obstacles(driver.world)
    driver.look_for(model.corners)
    agreed = total = 0
    for k in range(1500):
        driver.step({})
        if k % 100:
            continue
        for number, camera in enumerate(driver.cameras):
            frame = driver.first_frame(camera)
            T = se3_inverse(frame.truth.T_world_camera) @ frame.truth.T_world_target
            seen = predict_visibility(shape, T[None], rig.lenses[[number]], margin_px=0.0)
            obstacles.move(frame.joints)
            points = transform_points(frame.truth.T_world_target, shape.points)
            blocked = obstacles.blocked(frame.truth.T_world_camera[:3, 3], points)
            agreed += np.count_nonzero((seen.visible[0] & ~blocked) == frame.truth.visible)
            total += len(points)
    assert agreed > 0.95 * total
