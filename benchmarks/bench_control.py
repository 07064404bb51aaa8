"""One control tick: four points, six joints, against ViSP in C++ and machinevision-toolbox."""

from collections.abc import Callable
from importlib.resources import files
from typing import Any

import numpy as np
from numba import njit

from harness import calls, loops, row
from peer_programs import machinevision, visp
from vergence.arrays import FloatArray
from vergence.camera import Camera
from vergence.control import (
    CameraMounting,
    DampedPseudoInverse,
    MotionSettings,
    OptimalTracking,
    PoseServo,
    PositionBased,
    PseudoInverse,
    QuadraticProgram,
    Servo,
    Situation,
    Solver,
    TrackingSetup,
)
from vergence.control.objectives import optimal_tracking_tick, pack_setup
from vergence.control.objectives._tracking import (
    image_square,
    tracking_displacement,
    unpack_gains,
)
from vergence.geometry import se3, se3_compose
from vergence.robot import Arm
from vergence.signals import JointState, Observation, Reference, Setpoint, TargetState

POSE = np.array([-2.19, 0.75, -3.01, 0.1, -0.87, 0.2])
DESIRED = 0.1 * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
SEEN = DESIRED + np.array([0.05, -0.03])
DEPTH = np.array([0.60, 0.62, 0.63, 0.61])
FEATURES = np.column_stack((SEEN, DESIRED, DEPTH))


def puma() -> Arm:
    import mujoco

    model = str(files("vergence").joinpath("cells/puma560/puma560.xml"))
    return Arm.from_mujoco(mujoco.MjModel.from_xml_path(model), "flange", kind="body")


def setup_of(arm: Arm, S: float) -> TrackingSetup:
    servo = Servo(
        arm,
        Camera(640, 480, 1454.0, 1230.0, 319.5, 239.5),
        OptimalTracking(avoidance_axes=("x", "y", "z"), Q=8e-6, S=S),
        solver=PseudoInverse(),
        depth_m=DEPTH,
        situation=Situation(motion=MotionSettings(feed_forward=False, prediction=False)),
    )
    setup = servo.tracking
    assert setup is not None
    return setup


@njit(cache=True, error_model="numpy")
def tracking_twist(weights: FloatArray, features: FloatArray, v_camera: FloatArray) -> None:
    """The law alone, (17): no arm, no avoidance; fills the camera twist (6,)."""
    gains, focal_px = unpack_gains(weights), weights[7:9]
    BtB, Bt_error, _ = image_square(features, focal_px, gains.period)
    u = tracking_displacement(BtB, Bt_error, gains, 0.0, gains.avoiding)
    for i in range(6):
        v_camera[i] = u[i] / gains.period


def law_alone(setup: TrackingSetup) -> Callable[[], None]:
    """Interaction matrix and camera twist, without the arm: what `vpServo` does for a camera."""
    weights, v_camera = pack_setup(setup).weights, np.empty(6)
    return lambda: tracking_twist(weights, FEATURES, v_camera)


def whole_tick(setup: TrackingSetup) -> Callable[[], None]:
    """From features and joint positions to joint rates."""
    weights, joints = pack_setup(setup)
    result = np.empty(16)
    return lambda: optimal_tracking_tick(weights, joints, POSE, FEATURES, result)


@njit
def repeat_tick(count, weights, joints, q, features):  # type: ignore[no-untyped-def]
    """Ticks inside a kernel; each at a new configuration, so that none can be left out."""
    q, result = q.copy(), np.empty(len(q) + 10)
    for _ in range(count):
        q[0] += 1e-9
        optimal_tracking_tick(weights, joints, q, features, result)
    return result[0]


def inner_tick(arm: Arm, solver: Solver) -> Callable[[], object]:
    """An inner tick of position-based servoing: from the last set-point to joint rates."""
    camera = Camera(640, 480, 1454.0, 1230.0, 319.5, 239.5)
    at = Situation(period_s=1.0 / 500.0)
    servo = PoseServo(arm, CameraMounting(camera), PositionBased(), solver=solver, situation=at)
    ahead = se3(np.eye(3), np.array([0.01, 0.0, 0.5]))
    T_world_target = se3_compose(arm.forward_kinematics(POSE), ahead)
    target = TargetState(0.0, T_world_target, np.zeros(6), np.eye(12), True)
    desired = Reference(0.0, T_camera_target=se3(np.eye(3), np.array([0.0, 0.0, 0.5])))
    rest = np.zeros(len(POSE))
    servo.command(Observation(0.0, (), target), desired, JointState(0.0, POSE, rest))
    setpoint = Setpoint(POSE, rest)
    return lambda: servo.follow(setpoint)


def run() -> list[dict[str, Any]]:
    arm = puma()
    plain, avoiding = setup_of(arm, S=0.0), setup_of(arm, S=1e-6)
    alone = calls(law_alone(plain))
    tick, gradient = calls(whole_tick(plain)), calls(whole_tick(avoiding))
    packed = pack_setup(avoiding)
    inside = loops(lambda count: repeat_tick(count, *packed, POSE, FEATURES))
    by_inverse, by_program = (
        calls(inner_tick(arm, solver)) for solver in (DampedPseudoInverse(), QuadraticProgram())
    )
    return [
        row("control: interaction matrix + law", alone, visp("tick"), ratio_aim=0.15),
        row("control: interaction matrix + law", alone, machinevision("tick")),
        row("control: with kinematics", tick, visp("tick_kinematics"), ratio_aim=0.3),
        row("control: with exact w' gradient", gradient, visp("tick_joint_limits"), value_aim=4.0),
        row("control: the same, inside a kernel", inside, value_aim=2.5),
        row("position-based: inner tick, damped inverse", by_inverse),
        row("position-based: inner tick, quadratic program", by_program),
    ]
