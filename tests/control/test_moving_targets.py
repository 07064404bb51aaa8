"""Every law fed with the target's motion keeps up with it; without, it lags."""

from collections import deque
from collections.abc import Callable

import numpy as np
import pytest

from vergence.arrays import FloatArray
from vergence.cell import load_cell
from vergence.control import (
    CameraMounting,
    DampedPseudoInverse,
    ImageBased,
    Law,
    Limits,
    MotionSettings,
    OptimalTracking,
    PseudoInverse,
    QuadraticProgram,
    Servo,
    Situation,
)
from vergence.geometry import se3_inverse, transform_points
from vergence.robot import Arm
from vergence.signals import ImagePoints, JointState, Observation, Reference
from vergence.simulation import SimulatedDriver

PERIOD, LATENCY = 1 / 30, 2  # s, frames
VELOCITY = np.array([0.03, -0.02, 0.01])  # m/s
SQUARE = [[0.05, 0.05, 0.0], [-0.05, 0.05, 0.0], [-0.05, -0.05, 0.0], [0.05, -0.05, 0.0]]
SMOOTHING_S = 0.1

LawOf = Callable[[Arm, CameraMounting, FloatArray, bool], Law]  # the last: feed forward


def law_of(objective, solver, prediction=True):
    """Make a law from an arm, a mounting and depths, with the target's motion fed forward or not.

    Without a prediction and with nothing to feed forward it takes images as they are.
    """

    def build(arm, mounting, depth, feed_forward):
        motion = MotionSettings(feed_forward, prediction or feed_forward, SMOOTHING_S)
        limits = Limits(manipulability_share=0.0) if solver == QuadraticProgram() else None
        return Servo(
            arm, mounting, objective, limits=limits, solver=solver, depth_m=depth,
            situation=Situation(PERIOD, motion),
        )  # fmt: skip

    return build


TRACKING = OptimalTracking(Q=2e-6)
plain_image_based = law_of(ImageBased(gain=2.0), PseudoInverse())
plain_tracking = law_of(TRACKING, PseudoInverse())
constrained_image_based = law_of(ImageBased(gain=2.0), QuadraticProgram())
constrained_tracking = law_of(TRACKING, QuadraticProgram())
optimal_tracking = law_of(TRACKING, PseudoInverse(), prediction=False)
path_tracking = law_of(
    ImageBased(gain=2.0, interaction="desired"),
    DampedPseudoInverse(singular_below=1e-2),
    prediction=False,
)

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
    return driver.world.arm_to_camera("wrist"), CameraMounting(driver.cameras["wrist"]), q, T


@pytest.fixture(scope="module")
def before_a_stand():
    """The Puma that holds a plate before a fixed camera."""
    driver = SimulatedDriver(load_cell("eye_to_hand"), False)
    q = driver.read().joints["puma"].position
    arm = driver.world.arm_to_body("puma")
    T_hand_plate = se3_inverse(arm.forward_kinematics(q)) @ driver.world.target_pose()
    mounting = CameraMounting(
        driver.cameras["stand"], T_world_camera=driver.world.camera_pose("stand")
    )
    return arm, mounting, q, T_hand_plate


def lag_px(
    scene, law: Callable[[Arm, CameraMounting, FloatArray], Law], seconds: float = 4.0
) -> float:
    """Return how far the features are from where they should be when all has settled.

    The arm obeys at once, images come late, the target moves uniformly in its own frame.
    """
    arm, mounting, q, T_target = scene
    camera = mounting.camera
    points = transform_points(T_target, np.array(SQUARE))

    def image(time: float) -> tuple[FloatArray, FloatArray]:
        T = mounting.T_camera_scene(arm.forward_kinematics(q))
        moved = transform_points(T, points + time * VELOCITY)
        return camera.project(moved), moved[:, 2]

    desired, depth = image(0.0)
    servo, waiting = law(arm, mounting, depth), deque()
    reference = Reference(0.0, desired, velocity_px=np.zeros_like(desired), depth_m=depth)
    for k in range(int(seconds / PERIOD)):
        waiting.append((k * PERIOD, image(k * PERIOD)[0]))
        if len(waiting) <= LATENCY:
            continue
        time, seen = waiting.popleft()
        view = ImagePoints(
            "eye", time, seen, np.tile(np.eye(2), (4, 1, 1)), np.ones(4, bool), ("",) * 4
        )
        joints = JointState(k * PERIOD, q, np.zeros_like(q))
        q = q + PERIOD * servo.command(Observation(time, (view,)), reference, joints).velocity
    last = image((int(seconds / PERIOD)) * PERIOD)[0]
    return float(np.linalg.norm(last - desired, axis=1).max())


@pytest.mark.parametrize("law", LAWS)
def test_a_camera_in_the_hand_keeps_up_with_a_target_in_uniform_motion(over_a_board, law: LawOf):
    with_motion = lag_px(over_a_board, lambda *parts: law(*parts, True))
    without = lag_px(over_a_board, lambda *parts: law(*parts, False))
    assert without > 4.0
    assert with_motion < 0.05 * without


@pytest.mark.parametrize("law", LAWS)
def test_a_fixed_camera_keeps_what_slips_in_the_hand_in_its_place(before_a_stand, law: LawOf):
    with_motion = lag_px(before_a_stand, lambda *parts: law(*parts, True))
    without = lag_px(before_a_stand, lambda *parts: law(*parts, False))
    assert without > 4.0
    assert with_motion < 0.05 * without


def test_a_planned_path_is_carried_on_to_the_time_of_the_features():
    reference = Reference(
        1.0, np.zeros((4, 2)), velocity_px=np.full((4, 2), 3.0), depth_m=np.ones(4)
    )
    np.testing.assert_allclose(reference.at(1.5).points_px, 1.5)
    still = Reference(1.0, np.zeros((4, 2)))
    assert still.at(1.5) is still
