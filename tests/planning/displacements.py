"""Random large displacements of the gantry's camera, with the marks in view at both ends."""

import numpy as np
from gantry_cell import CAMERA, gantry, marks

from vergence.arrays import FloatArray
from vergence.geometry import se3, se3_inverse, so3_exp, so3_log, transform_points
from vergence.planning.problem import PlanningProblem
from vergence.robot.inverse_kinematics import goal_configurations


def facing_pose(random: np.random.Generator, roll: float) -> FloatArray:
    """Return the target's pose before a camera, tilted up to 45° about axes across the view."""
    tilt, about = np.radians(45) * np.sqrt(random.uniform()), random.uniform(-np.pi, np.pi)
    R = so3_exp(tilt * np.array([np.cos(about), np.sin(about), 0.0])) @ np.diag([1.0, -1.0, -1.0])
    T = se3(R @ so3_exp(np.array([0.0, 0.0, roll])), np.zeros(3))
    T[:3, 3] = [*random.uniform(-0.15, 0.15, 2), random.uniform(0.45, 1.2)]
    return T


def in_view(T_camera_target: FloatArray) -> bool:
    points = transform_points(T_camera_target, marks())
    return bool(points[:, 2].min() > 0.2 and CAMERA.contains(CAMERA.project(points), 15).all())


def random_displacement(
    random: np.random.Generator, roll_deg: tuple[float, float] | None = None
) -> PlanningProblem:
    """Return a problem of at least 0.3 m or 60°, the roll about the optical axis as given."""
    arm = gantry()
    middle, half = 0.5 * (arm.q_max + arm.q_min), 0.5 * (arm.q_max - arm.q_min)
    while True:
        first = random.uniform(-np.pi, np.pi)
        roll = random.uniform(-np.pi, np.pi)
        if roll_deg is not None:
            roll = first + random.choice([-1.0, 1.0]) * np.radians(random.uniform(*roll_deg))
        T_start, T_goal = facing_pose(random, first), facing_pose(random, roll)
        if not (in_view(T_start) and in_view(T_goal)):
            continue
        motion = T_goal @ se3_inverse(T_start)
        if np.linalg.norm(motion[:3, 3]) < 0.3 and np.linalg.norm(so3_log(motion[:3, :3])) < 1.05:
            continue
        q = middle + 0.97 * half * random.uniform(-1, 1, 6)
        T_world_goal = arm.forward_kinematics(q) @ se3_inverse(motion)
        goals = goal_configurations(arm, T_world_goal, q, 1)
        if len(goals) and np.abs(arm.normalized(goals[0])).max() < 0.97:
            points = transform_points(T_world_goal @ T_goal, marks())
            return PlanningProblem(arm, CAMERA, q, T_world_goal, points)
