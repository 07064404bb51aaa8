"""An arm before an object, where it should go, and random displacements of its camera."""

from dataclasses import dataclass
from typing import Self

import numpy as np

from vergence.arrays import FloatArray, frozen
from vergence.camera import Camera
from vergence.cell import Cell
from vergence.cell.joint_positions import goal_positions
from vergence.cell.schema import ReachTable
from vergence.geometry import se3, se3_inverse, so3_angle, so3_exp, transform_points
from vergence.planning import PlanningProblem
from vergence.robot import Arm, goal_configurations
from vergence.simulation import SimulatedDriver

EASY_M, EASY_RAD = 0.3, np.radians(60)  # displacements smaller than both are not asked for
CAMERA = Camera(640, 480, 600.0, 600.0, 319.5, 239.5)  # of a scene of its own
SQUARE = frozen([[0.1, 0.1, 0.0], [-0.1, 0.1, 0.0], [-0.1, -0.1, 0.0], [0.1, -0.1, 0.0]])  # m
END_MARGIN_PX, END_MARGIN_JOINT = 15.0, 0.03  # that starts and goals have


@dataclass(frozen=True, slots=True)
class Scene:
    """Arm, camera and object as they are."""

    arm: Arm  # up to the camera
    camera: Camera
    marks: FloatArray  # (N, 3) in the target's frame, m
    q_start: FloatArray  # (n,)
    T_world_goal: FloatArray  # (4, 4) of the camera
    T_world_target: FloatArray  # (4, 4)

    @classmethod
    def of(cls, cell: Cell) -> Self:
        """Read the scene off a cell whose task is to reach."""
        task = cell.task
        assert isinstance(task, ReachTable)
        driver = SimulatedDriver(cell, images=False)
        try:
            arm = driver.world.arm_to_camera(task.camera)
            q_start = driver.read().joints[task.arm].position
            T_target = driver.world.target_pose()
            camera = driver.cameras[task.camera]
            marks = driver.features
            q_goal = goal_positions(cell, driver.arms[task.arm])
        finally:
            driver.close()
        T_goal = frozen(arm.forward_kinematics(q_goal))
        return cls(arm, camera, frozen(marks), frozen(q_start), T_goal, frozen(T_target))

    @property
    def points_world(self) -> FloatArray:
        """The marks in the world, (N, 3), m."""
        points: FloatArray = transform_points(self.T_world_target.copy(), self.marks.copy())
        return points

    @property
    def goal_px(self) -> FloatArray:
        """Where the camera sees the marks from the goal, (N, 2)."""
        return self.seen_px(self.T_world_goal)

    def seen_px(self, T_world_camera: FloatArray) -> FloatArray:
        """Return where a camera at a pose (4, 4) sees the marks, (N, 2)."""
        return self.camera.project(
            transform_points(se3_inverse(T_world_camera.copy()), self.points_world)
        )

    def problem(self, margin_px: float = 0.0, margin_joint: float = 0.0) -> PlanningProblem:
        """Return the scene as a planning problem with nothing unknown."""
        return PlanningProblem(
            self.arm,
            self.camera,
            self.q_start,
            self.T_world_goal,
            self.points_world,
            margin_px,
            margin_joint,
        )

    @classmethod
    def drawn(
        cls,
        arm: Arm,
        camera: Camera,
        marks: FloatArray,
        random: np.random.Generator,
        roll_deg: tuple[float, float] | None = None,
        small: bool = False,
        tilt_deg: float = 45.0,
    ) -> Self:
        """Draw a displacement of the camera, marks in view at both ends.

        The object faces the camera within an angle at 0.45 to 1.2 m and is seen from its front, the
        side of +z; start and goal are inside the joint limits. Nothing is known of what lies
        between.

        Args:
            arm: up to the camera.
            camera: its intrinsics.
            marks: (N, 3) in the target's frame, m.
            random: draws it.
            roll_deg: range of the turn about the optical axis, either way; any if None.
            small: whether displacements below both `EASY_M` and `EASY_RAD` count as well.
            tilt_deg: angle within which the object faces the camera at both ends.
        """
        middle, half = 0.5 * (arm.q_max + arm.q_min), 0.5 * (arm.q_max - arm.q_min)
        free = 1.0 - END_MARGIN_JOINT
        while True:
            first, roll = random.uniform(-np.pi, np.pi, 2)
            if roll_deg is not None:
                roll = first + random.choice([-1.0, 1.0]) * np.radians(random.uniform(*roll_deg))
            T_start, T_goal = (_facing_pose(random, turn, tilt_deg) for turn in (first, roll))
            motion = T_goal @ se3_inverse(T_start)
            if not small and _is_easy(motion):
                continue
            if not (_in_view(camera, marks, T_start) and _in_view(camera, marks, T_goal)):
                continue
            q = middle + free * half * random.uniform(-1, 1, len(half))
            T_world_goal = arm.forward_kinematics(q) @ se3_inverse(motion)
            goals = goal_configurations(arm, T_world_goal, q, 1)
            if len(goals) and np.abs(arm.normalized(goals[0])).max() < free:
                return cls(arm, camera, marks, q, T_world_goal, T_world_goal @ T_goal)


def _in_view(camera: Camera, marks: FloatArray, T_camera_target: FloatArray) -> bool:
    """Return whether a camera sees the marks, from the front of their plane."""
    points = transform_points(T_camera_target, marks.copy())
    if points[:, 2].min() < 0.2 or T_camera_target[:3, 2] @ points.mean(axis=0) >= 0.0:
        return False
    return bool(camera.contains(camera.project(points), END_MARGIN_PX).all())


def _facing_pose(random: np.random.Generator, roll: float, tilt_deg: float) -> FloatArray:
    """Return the pose of a target that faces a camera, tilted about an axis across the view."""
    tilt, about = np.radians(tilt_deg) * np.sqrt(random.uniform()), random.uniform(-np.pi, np.pi)
    R = so3_exp(tilt * np.array([np.cos(about), np.sin(about), 0.0])) @ np.diag([1.0, -1.0, -1.0])
    place = np.array([*random.uniform(-0.15, 0.15, 2), random.uniform(0.45, 1.2)])
    T: FloatArray = se3(R @ so3_exp(np.array([0.0, 0.0, roll])), place)
    return T


def _is_easy(motion: FloatArray) -> bool:
    return bool(np.linalg.norm(motion[:3, 3]) < EASY_M and so3_angle(motion) < EASY_RAD)
