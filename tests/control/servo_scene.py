"""A kinematic world: an arm that obeys at once, a camera that sees where points truly project."""

from importlib.resources import files

import mujoco
import numpy as np

from vergence.camera import Camera
from vergence.control import MotionSettings, OptimalTracking, PseudoInverse, Servo, Situation
from vergence.geometry import se3_inverse, transform_points
from vergence.robot import Arm
from vergence.signals import ImagePoints, JointState, Observation, Reference

CAMERA = Camera(640, 480, 1454.5, 1230.8, 319.5, 239.5)
START = np.deg2rad([-125.6, 42.7, -172.7, 0.0, -50.0, 0.0])
SQUARE = 0.1 * np.array([[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 1.0, 0.0]])
PERIOD = 1 / 30
AS_IT_IS = Situation(PERIOD, MotionSettings(feed_forward=False, prediction=False))


def puma() -> Arm:
    """The Puma with a camera 0.12 m beyond its wrist, looking along the flange's axis."""
    spec = mujoco.MjSpec.from_file(str(files("vergence").joinpath("cells/puma560/puma560.xml")))
    # MuJoCo's cameras look along -z: turned about x, ours looks along the flange's z.
    spec.body("flange").add_camera(name="wrist", pos=[0, 0, 0.12], quat=[0, 1, 0, 0])
    return Arm.from_mujoco(spec.compile(), "wrist")


def tracking_law(arm: Arm, depth: np.ndarray, **numbers) -> Servo:
    """The law of [Nelson1995]; its Q is for one feature."""
    return Servo(
        arm,
        CAMERA,
        OptimalTracking(**numbers),
        solver=PseudoInverse(),
        depth_m=depth,
        situation=AS_IT_IS,
    )


def in_view(arm: Arm, q: np.ndarray, points: np.ndarray, depth: float = 1.0) -> np.ndarray:
    """World points that lie so before the camera at q."""
    return transform_points(arm.forward_kinematics(q), points + (0.0, 0.0, depth))


def seen(arm: Arm, q: np.ndarray, points_world: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Pixels and depths of world points."""
    points = transform_points(se3_inverse(arm.forward_kinematics(q)), points_world)
    return CAMERA.project(points), points[:, 2]


def observed(points_px: np.ndarray, found: np.ndarray | None = None) -> Observation:
    count = len(points_px)
    found = np.ones(count, dtype=np.bool_) if found is None else found
    view = ImagePoints(
        "wrist", 0.0, points_px, np.tile(np.eye(2), (count, 1, 1)), found, ("",) * count
    )
    return Observation(0.0, (view,))


def servo(
    arm: Arm,
    law: Servo,
    q: np.ndarray,
    points_world: np.ndarray,
    desired_px: np.ndarray,
    ticks: int,
    velocity_m_s: np.ndarray | None = None,
):
    """Let the law run; return every q (ticks + 1, n) and every image (ticks + 1, M, 2)."""
    points_world = points_world.copy()
    path, images = [q], []
    for _ in range(ticks):
        points_px, _ = seen(arm, path[-1], points_world)
        images.append(points_px)
        joints = JointState(0.0, path[-1], np.zeros(arm.joint_count))
        command = law.command(observed(points_px), Reference(0.0, desired_px), joints)
        path.append(path[-1] + PERIOD * command.velocity)
        if velocity_m_s is not None:
            points_world += PERIOD * velocity_m_s
    images.append(seen(arm, path[-1], points_world)[0])
    return np.array(path), np.array(images)
