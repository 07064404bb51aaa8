"""How a run of the defaults' study ended, judged strictly by what is true."""

from enum import StrEnum
from typing import NamedTuple

import numpy as np

from vergence.arrays import FloatArray
from vergence.geometry import se3_exp, se3_inverse, so3_angle, transform_points
from vergence.studies.reach_scene import Scene

REACHED_PX, REACHED_M, REACHED_DEG = 1.0, 1e-3, 0.1


class End(StrEnum):
    """How a run ended, judged by what is true."""

    REACHED = "reached"
    VIEW = "left the view"
    BEHIND = "behind the target"
    JOINT = "joint limit"
    STALLED = "stalled"
    UNNAMED = "stalled, unnamed"
    OFF = "right image, wrong pose"
    LATE = "out of time"
    NO_PLAN = "no plan"


class Finish(NamedTuple):
    """How a run ended."""

    end: End
    px: float  # true error of the farthest point
    m: float  # true distance of the camera from its goal
    deg: float  # and angle
    time: float  # s
    reason: str
    q: FloatArray  # (n,) where the joints are


class TrueScene:
    """What is true of a scene at joint positions: the study's only use of it.

    Args:
        scene: with flat marks.
        goal_noise_px: standard deviation of each coordinate of the marks in the desired image. No
            one can tell the goal from poses that show the same within three deviations.
    """

    def __init__(self, scene: Scene, goal_noise_px: float = 0.0) -> None:
        self._scene, self._points = scene, scene.points_world
        m, rad = _pose_deviation(scene, goal_noise_px) if goal_noise_px else (0.0, 0.0)
        self._tolerance_m = REACHED_M + 3.0 * m
        self._tolerance_deg = REACHED_DEG + 3.0 * float(np.degrees(rad))
        self._normal = scene.T_world_target[:3, 2] * np.sign(
            scene.T_world_target[:3, 2] @ (scene.T_world_goal[:3, 3] - self._points.mean(axis=0))
        )

    def look(self, q: FloatArray) -> tuple[FloatArray, FloatArray, End | None]:
        """Return points (M, 2) px, their depth (M,), and what of the rules is broken at q (n,)."""
        T = self._scene.arm.forward_kinematics(q)
        points = transform_points(se3_inverse(T), self._points)
        px = self._scene.camera.project(points)
        broken = None
        if self._normal @ (T[:3, 3] - self._points.mean(axis=0)) <= 0.0:
            broken = End.BEHIND
        elif points[:, 2].min() <= 0.0 or not self._scene.camera.contains(px).all():
            broken = End.VIEW
        elif self._scene.arm.outside(q).any():
            broken = End.JOINT
        return px, points[:, 2].copy(), broken

    def finish(self, q: FloatArray, end: End, time: float, reason: str) -> Finish:
        """Judge where a run ended: reached only if image and pose agree with the goal."""
        px, _, _ = self.look(q)
        error = float(np.linalg.norm(px - self._scene.goal_px, axis=1).max())
        off = se3_inverse(self._scene.T_world_goal.copy()) @ self._scene.arm.forward_kinematics(q)
        m = float(np.linalg.norm(off[:3, 3]))
        deg = float(np.degrees(so3_angle(off)))
        alike = m < self._tolerance_m and deg < self._tolerance_deg
        close = error < REACHED_PX and alike
        if close and end in (End.STALLED, End.UNNAMED, End.OFF, End.LATE):
            end = End.REACHED
        return Finish(end, error, m, deg, time, reason, q.copy())


def _pose_deviation(scene: Scene, noise_px: float) -> tuple[float, float]:
    """Return how well one image at the goal fixes the camera, m and rad, along the worst axes."""
    step, J = 1e-5, np.empty((scene.goal_px.size, 6))
    for k, twist in enumerate(step * np.eye(6)):
        ends = (scene.seen_px(scene.T_world_goal @ se3_exp(t)) for t in (twist, -twist))
        J[:, k] = np.subtract(*ends).ravel() / (2.0 * step)
    covariance = noise_px**2 * np.linalg.inv(J.T @ J)
    position, angle = (np.linalg.eigvalsh(covariance[k : k + 3, k : k + 3])[-1] for k in (0, 3))
    return float(np.sqrt(position)), float(np.sqrt(angle))
