"""The end effector keeps a desired pose relative to a moving target."""

import numpy as np
import pytest

from vergence.camera import Camera
from vergence.cell import load_cell
from vergence.control import (
    CameraMounting,
    DampedPseudoInverse,
    Guard,
    InnerLaw,
    MotionSettings,
    MovingPose,
    PoseServo,
    PositionBased,
    Situation,
    moved,
)
from vergence.geometry import se3, se3_compose, se3_inverse, se3_log, so3_exp
from vergence.robot import Arm
from vergence.signals import JointState, Observation, Reference, Setpoint, TargetState
from vergence.simulation import SimulatedDriver

RATE, OUTER = 500, 26
LATENCY_S = 1 / OUTER
DESIRED = np.array([[0.0, -1, 0, 0], [-1, 0, 0, 0], [0, 0, -1, 0.4], [0, 0, 0, 1]])


@pytest.fixture(scope="module")
def arms() -> dict[str, tuple[Arm, np.ndarray]]:
    """The six-joint arm and the one on a track, with their starts."""
    driver = SimulatedDriver(load_cell("lippiello2005"), images=False)
    six = driver.world.arm_to_body("master"), driver.world.joint_position("master")
    return {"six": six, "seven": (driver.arms["slave"], driver.world.joint_position("slave"))}


def law_of(
    arm: Arm, T_world_camera=None, feed_forward: bool = True, prediction: bool = True, **numbers
) -> PoseServo:
    mounting = CameraMounting(Camera(640, 480, 600, 600, 319.5, 239.5), T_world_camera)
    motion = MotionSettings(feed_forward, prediction)
    return PoseServo(
        arm,
        mounting,
        PositionBased(**numbers),
        solver=DampedPseudoInverse(),
        situation=Situation(1 / RATE, motion),
    )


def target_state(target: MovingPose, time: float) -> TargetState:
    return TargetState(time, target.T, target.twist, np.eye(12), True)


def follow(
    arm: Arm, start: np.ndarray, twist: np.ndarray, law: PoseServo, seconds: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return the tip's errors (K, 6) in its axes and joint positions (K, n), a row per outer tick.

    Joints follow their set-points at once; images are late by one frame.
    """
    T_target = se3_compose(arm.forward_kinematics(start), DESIRED)
    target = MovingPose(T_target, twist)
    guard = Guard(arm, start, 1 / RATE)
    errors, positions = [], []
    tick = 0
    for k in range(int(seconds * OUTER)):
        time = tick / RATE
        seen = MovingPose(moved(target, time - LATENCY_S), twist)
        observation = Observation(time - LATENCY_S, (), target_state(seen, time - LATENCY_S))
        joints = JointState(time, guard.position, np.zeros(arm.joint_count))
        law.command(observation, Reference(time, T_camera_target=DESIRED), joints)
        while tick < int((k + 1) * RATE / OUTER):
            guard.step(law.follow(guard.setpoint))
            tick += 1
        T_hand = arm.forward_kinematics(guard.position)
        T_desired = se3_compose(moved(target, tick / RATE), se3_inverse(DESIRED))
        errors.append(se3_log(se3_compose(se3_inverse(T_desired), T_hand)))
        positions.append(guard.position)
    return np.array(errors), np.array(positions)


@pytest.mark.parametrize("which", ["six", "seven"])
def test_a_target_at_constant_velocity_is_followed_without_error(
    which: str, arms: dict[str, tuple[Arm, np.ndarray]]
) -> None:
    arm, start = arms[which]
    twist = np.array([-0.03, 0.05, 0.02, 0.0, 0.05, 0.1])
    errors, _ = follow(arm, start, twist, law_of(arm), 2.0)
    assert np.abs(errors[-10:]).max() < 2e-4


def test_without_feed_forward_and_prediction_the_hand_lags_by_filter_and_latency(
    arms: dict[str, tuple[Arm, np.ndarray]],
) -> None:
    arm, start = arms["seven"]
    twist = np.array([0.0, 0.05, 0.0, 0.0, 0.0, 0.0])
    law = law_of(arm, filter_hz=5.0, feed_forward=False, prediction=False)
    errors, _ = follow(arm, start, twist, law, 2.0)
    least = 0.05 * (2 / (2 * np.pi * 5.0) + LATENCY_S)
    lag = np.linalg.norm(errors[-1, :3])
    assert least <= lag <= least + 0.05 / OUTER + 1e-4


@pytest.mark.parametrize("feed_forward", [True, False])
def test_a_target_that_stands_is_reached_either_way(
    feed_forward: bool, arms: dict[str, tuple[Arm, np.ndarray]]
) -> None:
    arm, start = arms["seven"]
    law = law_of(arm, feed_forward=feed_forward, prediction=feed_forward)
    errors, _ = follow(arm, start, np.zeros(6), law, 1.0)
    assert np.abs(errors).max() < 1e-9


def test_a_redundant_joint_leaves_its_limit_while_the_tip_stays(
    arms: dict[str, tuple[Arm, np.ndarray]],
) -> None:
    arm, start = arms["seven"]
    start = start.copy()
    start[0] = 0.95 * arm.q_max[0]
    law = law_of(arm, null_space_rate=0.5)
    errors, positions = follow(arm, start, np.zeros(6), law, 3.0)
    assert abs(positions[-1, 0]) < abs(start[0]) - 0.1
    assert np.abs(errors).max() < 1e-3


def test_limits_hold_when_the_target_flees_out_of_reach(
    arms: dict[str, tuple[Arm, np.ndarray]],
) -> None:
    arm, start = arms["six"]
    law = law_of(arm)
    _, positions = follow(arm, start, np.array([1.0, 0.5, 0.3, 0.5, 0.0, 0.0]), law, 4.0)
    assert np.isfinite(positions).all()
    assert (positions >= arm.q_min).all()
    assert (positions <= arm.q_max).all()


def test_without_a_target_the_arm_is_asked_to_stand(
    arms: dict[str, tuple[Arm, np.ndarray]],
) -> None:
    arm, start = arms["six"]
    law = law_of(arm)
    joints = JointState(0.0, start, np.zeros(6))
    T_target = se3_compose(arm.forward_kinematics(start), DESIRED)
    seen = Observation(0.0, (), target_state(MovingPose(T_target, np.ones(6)), 0.0))
    law.command(seen, Reference(0.0, T_camera_target=DESIRED), joints)
    assert law.follow(Setpoint(start, 0 * start)).any()
    command = law.command(Observation(0.1, ()), Reference(0.1, T_camera_target=DESIRED), joints)
    assert not command.velocity.any()
    assert not law.follow(Setpoint(start, 0 * start)).any()


def test_it_works_at_the_inner_rate(arms: dict[str, tuple[Arm, np.ndarray]]) -> None:
    assert isinstance(law_of(arms["six"][0]), InnerLaw)


def hold(arm: Arm, start: np.ndarray, slip: np.ndarray, law_settings: dict, seconds: float):
    """Bring a held object to a pose before a fixed camera while it slips (6,), in the tip's axes.

    Returns the distance of the target from the desired place, (K,) m, and its places, (K, 3).
    """
    T_world_camera = se3_compose(arm.forward_kinematics(start), np.diag([1.0, -1, -1, 1]))
    T_world_camera[:3, 3] += [0.3, 0.4, 0.5]
    offset = MovingPose(se3(so3_exp(np.array([0.1, 0.2, -0.1])), np.array([0.0, 0.02, 0.1])), slip)
    T_start = se3_compose(arm.forward_kinematics(start), offset.T)
    T_desired = T_start @ se3(so3_exp(np.array([0.3, -0.2, 0.2])), np.array([0.1, -0.1, 0.05]))
    law = law_of(arm, T_world_camera, **law_settings)
    reference = Reference(0.0, T_camera_target=se3_compose(se3_inverse(T_world_camera), T_desired))
    guard, tick, places, exposed = Guard(arm, start, 1 / RATE), 0, [], [start]
    for k in range(int(seconds * OUTER)):
        time = tick / RATE - LATENCY_S
        T_hand = arm.forward_kinematics(exposed[-2] if k else start)
        T_target = se3_compose(T_hand, moved(offset, time))
        twist = np.concatenate((T_hand[:3, :3] @ slip[:3], T_hand[:3, :3] @ slip[3:]))
        state = TargetState(time, T_target, twist, np.eye(12), True, T_hand)
        joints = JointState(tick / RATE, guard.position, np.zeros(arm.joint_count))
        law.command(Observation(time, (), state), reference, joints)
        while tick < int((k + 1) * RATE / OUTER):
            guard.step(law.follow(guard.setpoint))
            tick += 1
        exposed.append(guard.position)
        T_hand = arm.forward_kinematics(guard.position)
        places.append(se3_compose(T_hand, moved(offset, tick / RATE))[:3, 3])
    return np.linalg.norm(np.array(places) - T_desired[:3, 3], axis=1), np.array(places)


@pytest.mark.parametrize("which", ["six", "seven"])
def test_what_the_hand_holds_gets_to_its_place_before_a_fixed_camera(
    which: str, arms: dict[str, tuple[Arm, np.ndarray]]
) -> None:
    distance, _ = hold(*arms[which], np.zeros(6), {"filter_hz": 0.5}, 4.0)
    assert distance[0] > 0.1
    assert distance[-1] < 1e-4


def test_what_slips_in_the_hand_is_held_in_its_place_only_with_feed_forward(
    arms: dict[str, tuple[Arm, np.ndarray]],
) -> None:
    slip = np.array([0.01, 0.02, 0.0, 0.0, 0.0, 0.05])
    fed, _ = hold(*arms["seven"], slip, {}, 3.0)
    neither = {"feed_forward": False, "prediction": False}
    lagging, _ = hold(*arms["seven"], slip, neither, 3.0)
    assert lagging[-1] > 1e-3
    assert fed[-1] < 0.1 * lagging[-1]
