"""What the study of features looks at, and where its camera starts and should go."""

from dataclasses import dataclass
from functools import cache

import numpy as np

from vergence.arrays import FloatArray, frozen
from vergence.camera import Camera
from vergence.cell import load_cell
from vergence.features import Points
from vergence.geometry import ellipse_through, se3_inverse, transform_points, unit_vectors
from vergence.robot import Arm, goal_configurations
from vergence.studies.reach_scene import Scene

CAMERA = Camera(640, 480, 600.0, 600.0, 319.5, 239.5)
KINDS = ("points", "lines", "ellipse", "moments", "2.5d")
CELL = "puma560"  # whose arm carries the camera
GAIN, PERIOD_S, STEPS = 2.0, 0.05, 200  # 1/s, s, and of a run at most
ARRIVED_PX = 1.0  # every point this near to its goal
ROLL_DEG, TILT_DEG = (0.0, 80.0), 30.0  # between start and goal, and of the target at both
SAME_POSTURE_RAD = np.radians(90.0)
CIRCLE = (0.01, 0.0, 0.08)  # x, y and radius in the target's plane, m
_POLYGON = [[-0.1, -0.08], [0.12, -0.06], [0.14, 0.02], [0.05, 0.1], [-0.04, 0.07], [-0.12, 0.04]]
_ON_CIRCLE = 16
CORNERS = frozen(np.column_stack((_POLYGON, np.zeros(6))))


def body(kind: str) -> FloatArray:
    """Return the points in the target's frame that a kind of feature is made of, (M, 3), m."""
    if kind == "ellipse":
        x, y, radius = CIRCLE
        around = radius * unit_vectors(_ON_CIRCLE) + (x, y)
        return np.column_stack((around, np.zeros(_ON_CIRCLE)))
    if kind == "lines":
        return sides(CORNERS)
    return CORNERS


def sides(corners: FloatArray) -> FloatArray:
    """Return the two ends of each side of a polygon, one after the other, (2M, 3)."""
    return np.stack((corners, np.roll(corners, -1, axis=0)), axis=1).reshape(-1, corners.shape[1])


def seen(kind: str, T_camera_target: FloatArray) -> Points | None:
    """Return the points of a kind of feature in the image, with depths; None if it turned away."""
    points = transform_points(T_camera_target.copy(), body(kind).copy())
    depth = points[:, 2]
    if T_camera_target[:3, 2] @ T_camera_target[:3, 3] >= 0.0 or not (depth > 0.0).all():
        return None
    return Points(points[:, :2] / depth[:, None], depth)


def compared(kind: str, points: FloatArray) -> FloatArray:
    """Return the points (M, 2) that have to stay in view and to arrive, from those of a feature.

    An ellipse does not tell one of its points from another: of it, those that depend on it alone.
    """
    if kind != "ellipse":
        return points
    shape = ellipse_through(points)
    assert shape is not None
    return shape.points(_ON_CIRCLE)


@dataclass(frozen=True, slots=True)
class Start:
    """Where a camera begins before the target, and where it should go."""

    q: FloatArray  # (n,) joint positions of the arm at the start
    T_camera_target: FloatArray  # (4, 4)
    T_goal_target: FloatArray  # (4, 4)

    @property
    def straight_m(self) -> float:
        """Distance of the camera between start and goal."""
        places = (se3_inverse(T.copy())[:3, 3] for T in (self.T_camera_target, self.T_goal_target))
        return float(np.linalg.norm(next(places) - next(places)))


@cache
def arm() -> Arm:
    """Return the arm up to its camera."""
    from vergence.simulation import SimulatedDriver

    driver = SimulatedDriver(load_cell(CELL), images=False)
    try:
        camera = load_cell(CELL).task.camera
        found: Arm = driver.world.arm_to_camera(camera)
        return found
    finally:
        driver.close()


def draw_start(seed: int, number: int) -> Start:
    """Draw a start and a goal within the joint limits that both show the whole target.

    Some joint positions of the goal are within `SAME_POSTURE_RAD` of the start's, each joint, so a
    straight way of the joints keeps all joint limits.
    """
    random = np.random.default_rng([seed, 16, number])
    marks = np.vstack((CORNERS, body("ellipse")))
    while True:
        scene = Scene.drawn(arm(), CAMERA, marks, random, ROLL_DEG, small=True, tilt_deg=TILT_DEG)
        (q_goal,) = goal_configurations(scene.arm, scene.T_world_goal, scene.q_start, 1)
        if np.abs(q_goal - scene.q_start).max() < SAME_POSTURE_RAD:
            break
    T_world_camera = scene.arm.forward_kinematics(scene.q_start)
    now, goal = (
        se3_inverse(T.copy()) @ scene.T_world_target for T in (T_world_camera, scene.T_world_goal)
    )
    return Start(frozen(scene.q_start), frozen(now), frozen(goal))
