"""A held object stays in a fixed camera's view, whatever motion is desired."""

import numpy as np
import pytest

from vergence.cell import load_cell
from vergence.control import CameraMounting, Limits, QuadraticProgram, TargetView
from vergence.control.solvers import Problem, Setting
from vergence.control.solvers.solver import NO_JOINTS
from vergence.geometry import se3_inverse, transform_points
from vergence.signals import TargetState
from vergence.simulation import SimulatedDriver

PERIOD, MARGIN_PX = 1 / 500, 20.0
CORNERS = 0.05 * np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])


@pytest.fixture(scope="module")
def scene():
    """Arm with the target as its tip, camera, its pose, and the joints at the start."""
    driver = SimulatedDriver(load_cell("eye_to_hand_pose"), images=False)
    pose = driver.world.camera_pose("front")
    return driver.world.arm_to_target(), driver.cameras["front"], pose, driver.read().joints["puma"]


def push(scene, v_world, seconds):
    """Let the tip move on and on; return the corners' pixels on the way, (K, 8, 2)."""
    arm, camera, T_world_camera, joints = scene
    mounting = CameraMounting(camera, T_world_camera=T_world_camera)
    limits = Limits(view_margin_px=MARGIN_PX, manipulability_share=0.0)
    solver = QuadraticProgram().bind(Setting(arm, mounting, limits, PERIOD))
    view, q, rates = (
        TargetView(mounting, CORNERS, *solver.view),
        joints.position.copy(),
        np.zeros(6),
    )
    seen = []
    for k in range(int(seconds / PERIOD)):
        T = arm.forward_kinematics(q)
        T_camera_target = se3_inverse(T_world_camera) @ T
        if k % 20 == 0:
            state = TargetState(k * PERIOD, T, np.zeros(6), np.zeros((12, 12)), True, T)
            view.see(state, T_camera_target, k * PERIOD)
        twist = np.concatenate((T[:3, :3].T @ v_world, np.zeros(3)))
        A = mounting.twist_map(T)
        problem = Problem(q, rates, np.eye(6), twist, view.features(T), np.zeros(6), *NO_JOINTS, A)
        answer = solver.solve(problem)
        np.testing.assert_allclose(arm.jacobian(q) @ answer.rates, answer.v_tip, atol=1e-9)
        rates = answer.rates
        q = q + PERIOD * rates
        seen.append(camera.project(transform_points(T_camera_target, CORNERS)))
    return np.array(seen), answer


def test_a_hand_that_is_asked_for_little_does_just_that(scene):
    v_world = np.array([0.0, 0.02, 0.01])
    _, answer = push(scene, v_world, 0.5)
    np.testing.assert_allclose(np.linalg.norm(answer.v_tip[:3]), np.linalg.norm(v_world), 1e-3)
    np.testing.assert_allclose(answer.v_tip[3:], 0.0, atol=1e-4)


@pytest.mark.parametrize("direction", [-1.0, 1.0])
def test_the_hand_stops_before_a_corner_leaves_the_image(scene, direction):
    camera, T_world_camera = scene[1], scene[2]
    seen, _ = push(scene, 0.15 * direction * T_world_camera[:3, 1], 3.0)
    low, high = seen[..., 1].min(), seen[..., 1].max()
    nearest = low if direction < 0 else camera.height - 1 - high
    assert MARGIN_PX - 2.0 < nearest < MARGIN_PX + 15.0
