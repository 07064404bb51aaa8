"""Every law fed with the target's motion keeps up with it; without, it lags."""

from collections import deque
from collections.abc import Callable

import numpy as np
import pytest

from vergence.arrays import FloatArray
from vergence.camera import Camera
from vergence.cell import load_cell
from vergence.control import (
    ConstrainedLaw,
    ConstrainedSolver,
    ImageBased,
    Law,
    OptimalTracking,
    OptimalTrackingLaw,
    PathTrackingLaw,
    PlainLaw,
)
from vergence.geometry import se3_inverse, transform_points
from vergence.robot import Arm, reverse_arm
from vergence.signals import ImagePoints, JointState, Observation, Reference
from vergence.simulation import SimulatedDriver

PERIOD, LATENCY = 1 / 30, 2  # s, frames
VELOCITY = np.array([0.03, -0.02, 0.01])  # m/s
SQUARE = [[0.05, 0.05, 0.0], [-0.05, 0.05, 0.0], [-0.05, -0.05, 0.0], [0.05, -0.05, 0.0]]
SMOOTHING_S = 0.1

LawOf = Callable[[Arm, Camera, FloatArray, float], Law]  # the last is the smoothing of the flow


def plain_image_based(arm, camera, depth, smoothing):
    return PlainLaw(arm, camera, ImageBased(camera, 2.0), depth, flow_smoothing_s=smoothing)


def plain_tracking(arm, camera, depth, smoothing):
    return PlainLaw(arm, camera, OptimalTracking(camera, Q=5e-7), depth, flow_smoothing_s=smoothing)


def constrained_image_based(arm, camera, depth, smoothing):
    objective = ImageBased(camera, 2.0)
    return ConstrainedLaw(
        ConstrainedSolver(arm, camera), objective, depth, flow_smoothing_s=smoothing
    )


def constrained_tracking(arm, camera, depth, smoothing):
    objective = OptimalTracking(camera, Q=5e-7)
    return ConstrainedLaw(
        ConstrainedSolver(arm, camera), objective, depth, flow_smoothing_s=smoothing
    )


def optimal_tracking(arm, camera, depth, smoothing):
    known = None if np.isinf(smoothing) else smoothing
    return OptimalTrackingLaw(arm, camera, depth, Q=5e-7, flow_smoothing_s=known)


def path_tracking(arm, camera, depth, smoothing):
    known = None if np.isinf(smoothing) else smoothing
    return PathTrackingLaw(arm, camera, flow_smoothing_s=known)


LAWS = (
    plain_image_based,
    plain_tracking,
    constrained_image_based,
    constrained_tracking,
    optimal_tracking,
    path_tracking,
)


@pytest.fixture(scope="module")
def over_a_board():
    """The Puma over its board: arm, camera, start, and where the board's features are."""
    driver = SimulatedDriver(load_cell("puma560").replace(target={"features": SQUARE}), False)
    T = driver.world.target_pose()
    q = driver.read().joints["puma"].position
    return driver.world.arm_to_camera("wrist"), driver.cameras["wrist"], q, T


@pytest.fixture(scope="module")
def before_a_stand():
    """The Puma that holds a plate before a camera: its arm walked backwards, q reversed."""
    driver = SimulatedDriver(load_cell("eye_to_hand"), False)
    q = driver.read().joints["puma"].position
    arm = driver.world.arm_to_body("puma")
    T_hand_plate = se3_inverse(arm.forward_kinematics(q)) @ driver.world.target_pose()
    backwards = reverse_arm(arm, driver.world.camera_pose("stand"))
    return backwards, driver.cameras["stand"], q[::-1], T_hand_plate


def lag_px(scene, law: Callable[[Arm, Camera, FloatArray], Law], seconds: float = 4.0) -> float:
    """Return how far the features are from where they are wanted when all has settled.

    The arm obeys at once, pictures come late, the target moves uniformly in the frame of the base.
    """
    arm, camera, q, T_target = scene
    points = transform_points(T_target, np.array(SQUARE))

    def picture(time: float) -> tuple[FloatArray, FloatArray]:
        T = se3_inverse(arm.forward_kinematics(q))
        moved = transform_points(T, points + time * VELOCITY)
        return camera.project(moved), moved[:, 2]

    desired, depth = picture(0.0)
    servo, waiting = law(arm, camera, depth), deque()
    reference = Reference(0.0, desired, np.zeros_like(desired), depth)
    for k in range(int(seconds / PERIOD)):
        waiting.append((k * PERIOD, picture(k * PERIOD)[0]))
        if len(waiting) <= LATENCY:
            continue
        time, seen = waiting.popleft()
        view = ImagePoints(
            "eye", time, seen, np.tile(np.eye(2), (4, 1, 1)), np.ones(4, bool), ("",) * 4
        )
        joints = JointState(k * PERIOD, q, np.zeros_like(q))
        q = q + PERIOD * servo.command(Observation(time, (view,)), reference, joints).velocity
    last = picture((int(seconds / PERIOD)) * PERIOD)[0]
    return float(np.linalg.norm(last - desired, axis=1).max())


@pytest.mark.parametrize("law", LAWS)
def test_a_camera_in_the_hand_keeps_up_with_a_target_in_uniform_motion(over_a_board, law: LawOf):
    with_motion = lag_px(over_a_board, lambda *parts: law(*parts, SMOOTHING_S))
    without = lag_px(over_a_board, lambda *parts: law(*parts, np.inf))
    assert without > 4.0
    assert with_motion < 0.05 * without


@pytest.mark.parametrize("law", LAWS)
def test_a_fixed_camera_keeps_what_slips_in_the_hand_in_its_place(before_a_stand, law: LawOf):
    with_motion = lag_px(before_a_stand, lambda *parts: law(*parts, SMOOTHING_S))
    without = lag_px(before_a_stand, lambda *parts: law(*parts, np.inf))
    assert without > 4.0
    assert with_motion < 0.05 * without


def test_a_planned_path_is_carried_on_to_the_time_of_the_features():
    reference = Reference(1.0, np.zeros((4, 2)), np.full((4, 2), 3.0), np.ones(4))
    np.testing.assert_allclose(reference.at(1.5).points_px, 1.5)
    still = Reference(1.0, np.zeros((4, 2)))
    assert still.at(1.5) is still
