"""A path of joints, camera and image points, without time."""

from dataclasses import dataclass
from typing import Self

import numpy as np

from vergence.arrays import BoolArray, FloatArray, frozen
from vergence.geometry import se3_inverse, transform_points
from vergence.planning.problem import PlanningProblem


@dataclass(frozen=True, slots=True, repr=False)
class Path:
    """Waypoints that are dense enough for interpolating splines."""

    problem: PlanningProblem
    q: FloatArray  # (K, n) joint positions
    T_world_camera: FloatArray  # (K, 4, 4)
    points_px: FloatArray  # (K, N, 2) image of the points
    depth_m: FloatArray  # (K, N) of the points along the optical axis
    planner: str  # name of the planner that found it

    def __repr__(self) -> str:
        """How many waypoints there are, and of what."""
        points, joints = self.points_px.shape[1], self.q.shape[1]
        what = f"{len(self.q)} waypoints of {joints} joints and {points} points"
        return f"Path({what}, by {self.planner})"

    def __bool__(self) -> bool:
        """A path is true as a condition."""
        return True

    @classmethod
    def through(cls, problem: PlanningProblem, q: FloatArray, planner: str) -> Self:
        """Return the path through joint waypoints (K, n), with images from the arm's kinematics."""
        poses = np.array([problem.arm.forward_kinematics(waypoint) for waypoint in q])
        points = np.array([transform_points(se3_inverse(T), problem.points_world) for T in poses])
        pixels = np.array([problem.camera.project(seen) for seen in points])
        return cls.of(problem, q, poses, pixels, points[:, :, 2], planner)

    @classmethod
    def of(
        cls,
        problem: PlanningProblem,
        q: FloatArray,
        poses: FloatArray,
        pixels: FloatArray,
        depths: FloatArray,
        planner: str,
    ) -> Self:
        """Return a path of waypoints whose images the planner already knows."""
        count = len(q)
        return cls(
            problem,
            frozen(q, (count, None), "q"),
            frozen(poses, (count, 4, 4), "poses"),
            frozen(pixels, (count, None, 2), "pixels"),
            frozen(depths, (count, None), "depths"),
            planner,
        )

    def in_view(self, margin_px: float = 0.0) -> BoolArray:
        """Return at which waypoints all points are in the image, (K,)."""
        camera, count = self.problem.camera, self.points_px.shape[1]
        inside = camera.contains(self.points_px.reshape(-1, 2), margin_px).reshape(-1, count)
        return np.asarray((inside & (self.depth_m > 0)).all(axis=1))

    def in_front(self) -> BoolArray:
        """Return at which waypoints the camera is in front of every face of the object, (K,)."""
        faces, eyes = self.problem.faces, self.T_world_camera[:, :3, 3]
        outward = [(eyes - face[:3]) @ face[3:6] > 0.0 for face in faces]
        return np.asarray(np.all([np.ones(len(eyes), dtype=np.bool_), *outward], axis=0))

    @property
    def joints_normalized(self) -> FloatArray:
        """Joint positions scaled so that the limits are -1 and 1, (K, n)."""
        return self.problem.arm.normalized(self.q)

    @property
    def joint_margin(self) -> float:
        """Smallest distance to a joint limit relative to half the range; negative beyond it."""
        return float(1.0 - np.abs(self.joints_normalized).max())

    @property
    def image_margin_px(self) -> float:
        """Smallest distance of a point to the border of the image; negative outside."""
        camera = self.problem.camera
        u, v = self.points_px[..., 0], self.points_px[..., 1]
        sides = (u + 0.5, camera.width - 0.5 - u, v + 0.5, camera.height - 0.5 - v)
        return float(np.min(sides)) if (self.depth_m > 0).all() else -np.inf

    @property
    def camera_length_m(self) -> float:
        """Length of the focal point's path."""
        return float(np.linalg.norm(np.diff(self.T_world_camera[:, :3, 3], axis=0), axis=1).sum())
