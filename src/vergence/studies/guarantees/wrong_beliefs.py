"""What the laws of random runs are told: poses believed wrongly, and goals that move."""

from dataclasses import dataclass

import numpy as np

from vergence.arrays import FloatArray
from vergence.signals import Frame, Observation, Reference, TargetState
from vergence.simulation import ExactPoints


class WrongDepthPose:
    """Observes the target's pose as it is, but nearer or farther than it is; its velocity, too.

    Args:
        camera: whose frames it looks at.
        depth_factor: believed distance over true.
    """

    def __init__(self, camera: str, depth_factor: float) -> None:
        self._points, self._factor = ExactPoints(camera), depth_factor
        self._last: tuple[float, FloatArray] | None = None  # time, where the target was

    def observe(self, frames: tuple[Frame, ...]) -> Observation | None:
        """Return points and pose in the frames that arrived, or None if none did."""
        seen = self._points.observe(frames)
        if seen is None or frames[-1].truth is None or not seen.views[-1].found.any():
            return seen
        truth, time = frames[-1].truth, frames[-1].time
        T, eye = truth.T_world_target.copy(), truth.T_world_camera[:3, 3]
        T[:3, 3] = eye + self._factor * (T[:3, 3] - eye)
        velocity = np.zeros(6)
        if self._last is not None and time > self._last[0]:
            velocity[:3] = (T[:3, 3] - self._last[1]) / (time - self._last[0])
        self._last = time, T[:3, 3]
        state = TargetState(time, T, velocity, 1e-6 * np.eye(12), True)
        return Observation(seen.time, seen.views, state)


@dataclass(frozen=True, slots=True)
class MovingGoal:
    """A planner whose points run off at a constant velocity, as along a plan without an end."""

    points_px: FloatArray  # (M, 2) at time 0
    velocity_px: FloatArray  # (2,) px/s
    depth_m: FloatArray  # (M,)
    T_camera_target: FloatArray  # (4, 4)

    def reference(self, time: float) -> Reference:
        """Return what the law should aim at."""
        velocity = np.tile(self.velocity_px, (len(self.points_px), 1))
        points = self.points_px + time * velocity
        return Reference(
            time,
            points,
            velocity_px=velocity,
            depth_m=self.depth_m,
            T_camera_target=self.T_camera_target,
        )
