"""A closed loop without dynamics or delay: joints move as commanded, images are projections."""

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from typing import Self

import numpy as np

from vergence.arrays import FloatArray
from vergence.camera import Camera
from vergence.geometry import se3_inverse, transform_points
from vergence.robot import Arm

PERIOD = 0.04  # s
ARRIVED_PX = 1.0  # from where each point should be
STEADY = 10  # images in a row that close

# Joint rates (n,) from the time (s), joint positions (n,) and measured points (N, 2) px.
Steer = Callable[[float, FloatArray, FloatArray], FloatArray]


class Ending(StrEnum):
    """How a servoing ended."""

    ARRIVED = "arrived"
    VIEW = "left the view"
    JOINT = "joint limit"
    SHORT = "did not arrive"
    PAUSED = "paused"
    NO_PLAN = "no plan"


@dataclass(frozen=True, slots=True)
class Motion:
    """How it went; a row an image."""

    ending: Ending
    reason: str  # a sentence; empty if it arrived
    q: FloatArray  # (K, n)
    points_px: FloatArray  # (K, N, 2) true
    error_px: FloatArray  # (K,) largest distance of a point from its goal
    parts: int = 1  # put together from so many

    @property
    def duration(self) -> float:
        """Time until it ended, s."""
        return PERIOD * (len(self.q) - 1)

    def then(self, other: Self) -> Self:
        """Return this motion and another that continues where it ended."""
        return type(self)(
            other.ending,
            other.reason,
            np.concatenate((self.q[:-1], other.q)),
            np.concatenate((self.points_px[:-1], other.points_px)),
            np.concatenate((self.error_px[:-1], other.error_px)),
            self.parts + 1,
        )


@dataclass(frozen=True, slots=True)
class IdealLoop:
    """An arm with a camera before motionless points; a limit passed ends a run."""

    arm: Arm
    camera: Camera
    points_world: FloatArray  # (N, 3)
    goal_px: FloatArray  # (N, 2)
    noise_px: float = 0.0  # standard deviation of a measured coordinate

    def run(
        self,
        q_start: FloatArray,
        steer: Steer,
        longest_s: float,
        random: np.random.Generator,
        shortest_s: float = 0.0,
        pause: Callable[[FloatArray], bool] = lambda _q: False,
    ) -> Motion:
        """Servo until the points stay at their goal, something forbidden happens, or time is up.

        Args:
            q_start: (n,).
            steer: the law.
            longest_s: when to give up.
            random: draws the noise.
            shortest_s: before which it has not arrived, such as the time of a plan.
            pause: whether to stop before joint positions (n,), to think again.
        """
        rows: list[tuple[FloatArray, FloatArray, float]] = []
        q, close, end = q_start.copy(), 0, (Ending.SHORT, "")
        for k in range(int(longest_s / PERIOD) + 1):
            points, px = self._look(q)
            error = float(np.linalg.norm(px - self.goal_px, axis=1).max())
            rows.append((q, px, error))
            broken = self._broken(q, points, px, k * PERIOD)
            close = close + 1 if error < ARRIVED_PX and k * PERIOD >= shortest_s else 0
            if broken is not None or close >= STEADY:
                end = broken or (Ending.ARRIVED, "")
                break
            measured = px + self.noise_px * random.normal(size=px.shape)
            ahead = q + PERIOD * steer(k * PERIOD, q, measured)
            if pause(ahead):
                end = (Ending.PAUSED, f"at {k * PERIOD:.2f} s")
                break
            q = ahead
        else:
            end = (Ending.SHORT, f"{rows[-1][2]:.3g} px away after {longest_s:.3g} s")
        joints, pixels, errors = (np.array(column) for column in zip(*rows, strict=True))
        return Motion(*end, joints, pixels, errors)

    def _look(self, q: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the points in the camera's frame (N, 3), and in its image (N, 2)."""
        T_camera_world = se3_inverse(self.arm.forward_kinematics(q))
        points = transform_points(T_camera_world, self.points_world)
        return points, self.camera.project(points)

    def _broken(
        self, q: FloatArray, points: FloatArray, px: FloatArray, time: float
    ) -> tuple[Ending, str] | None:
        lost = ~self.camera.contains(px) | (points[:, 2] <= 0.0)
        if lost.any():
            which = int(np.flatnonzero(lost)[0]) + 1
            return Ending.VIEW, f"mark {which} left the image at {time:.2f} s"
        outside = self.arm.outside(q)
        if outside.any():
            joint = self.arm.names[int(np.flatnonzero(outside)[0])]
            return Ending.JOINT, f"{joint} reached its limit at {time:.2f} s"
        return None
