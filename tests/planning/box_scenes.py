"""A box with marks on two of its faces, and cameras that see both from start and goal."""

import numpy as np
from gantry_cell import CAMERA

from vergence.arrays import FloatArray
from vergence.estimation import TargetShape
from vergence.estimation.feature_faces import FeatureFaces, face_sines
from vergence.geometry import se3, se3_inverse, so3_exp, transform_points
from vergence.planning import PlanningProblem
from vergence.robot import Arm, goal_configurations
from vergence.studies.reach_scene import Scene

MARKS = np.array(
    [[0.05, 0.04, 0.05], [-0.05, 0.04, 0.05], [-0.04, -0.04, 0.05],
     [0.08, 0.04, 0.02], [0.08, -0.04, -0.02], [0.08, -0.03, 0.03]]
)  # fmt: skip
BOX = TargetShape.box(np.array([0.16, 0.12, 0.10]))
FACES = FeatureFaces.of_shape(
    TargetShape.from_mesh(
        MARKS,
        BOX.surface.triangles.reshape(-1, 3),
        np.arange(3 * len(BOX.surface.triangles)).reshape(-1, 3),
    )
)
LEAST_DEG = 8.0  # at which start and goal see either face


def drawn(arm: Arm, seed: int) -> Scene:
    """Return a box before an arm, its marks seen from start and goal, near a limit or not."""
    random = np.random.default_rng([77, seed])
    middle, half = 0.5 * (arm.q_max + arm.q_min), 0.5 * (arm.q_max - arm.q_min)
    while True:
        T_start, T_goal = (seen_pose(random) for _ in range(2))
        q = middle + 0.97 * half * random.uniform(-1, 1, len(half))
        T_world_goal = arm.forward_kinematics(q) @ T_start @ se3_inverse(T_goal)
        goals = goal_configurations(arm, T_world_goal, q, 1)
        if len(goals) and np.abs(arm.normalized(goals[0])).max() < 0.97:
            return Scene(arm, CAMERA, MARKS, q, T_world_goal, T_world_goal @ T_goal)


def seen_pose(random: np.random.Generator) -> FloatArray:
    """Return a pose of the box that shows all marks to a camera, (4, 4)."""
    while True:
        R = so3_exp(random.uniform(0, np.pi) * unit(random))
        T: FloatArray = se3(R, np.append(random.uniform(-0.15, 0.15, 2), random.uniform(0.45, 1.2)))
        points = transform_points(T, MARKS)
        eye = se3_inverse(T)[:3, 3]
        if points[:, 2].min() < 0.2 or not CAMERA.contains(CAMERA.project(points), 15.0).all():
            continue
        if face_sines(eye, FACES.planes).min() > np.sin(np.radians(LEAST_DEG)):
            return T


def unit(random: np.random.Generator) -> FloatArray:
    direction = random.normal(size=3)
    return np.asarray(direction / np.linalg.norm(direction))


def least_sine(scene: Scene, q: FloatArray) -> float:
    """Return the sine at which the camera sees the face that is turned away most."""
    T = se3_inverse(scene.T_world_target.copy()) @ scene.arm.forward_kinematics(q)
    return float(face_sines(np.ascontiguousarray(T[:3, 3]), FACES.planes).min())


def problem(scene: Scene, known: bool) -> PlanningProblem:
    """Return the scene as a planning problem, with the box's faces known or not."""
    R, p = scene.T_world_target[:3, :3], scene.T_world_target[:3, 3]
    planes = np.column_stack((FACES.planes[:, :3] @ R.T + p, FACES.planes[:, 3:] @ R.T))
    surface = FACES._replace(planes=planes) if known else None
    return PlanningProblem(
        scene.arm, CAMERA, scene.q_start, scene.T_world_goal, scene.points_world, surface=surface
    )
