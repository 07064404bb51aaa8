"""A timed path: the reference of the law at any time."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Self

import numpy as np

from vergence.arrays import FloatArray
from vergence.planning.path import Path
from vergence.planning.timing import SteadyLaw, TimeLaw, fastest_law, pace
from vergence.signals import Reference

if TYPE_CHECKING:
    from scipy.interpolate import CubicSpline

MARGIN = 0.98  # of the limits, for what lies between the points where they are checked


@dataclass(frozen=True, slots=True)
class Trajectory:
    """C² splines of image points, depths and joints over a path parameter σ, with its time law.

    [Mezouar2001] section 4; the splines are cubic and interpolate the waypoints.
    """

    path: Path
    law: TimeLaw | SteadyLaw
    _image: "CubicSpline"  # of (N, 2) px
    _depth: "CubicSpline"  # of (N,) m
    _joints: "CubicSpline"  # of (n,)
    desired_px: FloatArray | None = None  # (N, 2) after the end; that of the path's end if None

    @classmethod
    def of(
        cls, path: Path, camera_speed: float = 0.5, desired_px: FloatArray | None = None
    ) -> Self:
        """Time a path as fast as the arm's limits and the camera's speed allow.

        Args:
            path: from a planner.
            camera_speed: m/s; rotation is weighted by the distance of the object.
            desired_px: desired image after the end, (N, 2); that of the path's end if None.
        """
        from scipy.interpolate import CubicSpline

        path = _at_least_four(path)
        sigma = pace(path, camera_speed)
        image, depth, joints = (
            CubicSpline(sigma, values) for values in (path.points_px, path.depth_m, path.q)
        )
        arm, places = path.problem.arm, np.linspace(0.0, 1.0, 8 * len(sigma))
        law = fastest_law(
            joints(places, 1), joints(places, 2), MARGIN * arm.rate_max,
            MARGIN**2 * arm.acceleration_max,
        )  # fmt: skip
        shortest = _way(path) / camera_speed / (1.0 - law.ramp)
        timing = TimeLaw(max(law.duration, shortest), law.ramp)
        return cls(path, timing, image, depth, joints, desired_px)

    @classmethod
    def in_steps(cls, path: Path, period_s: float) -> Self:
        """Time a path as [Mezouar2001] section 4 does: t_k = kT, through a natural spline.

        It starts and stops abruptly and ignores limits: the planner's step determines the speed.

        Args:
            path: from a planner, with steps of equal length.
            period_s: T, between two waypoints.
        """
        from scipy.interpolate import CubicSpline

        path = _at_least_four(path)
        steps = len(path.q) - 1
        sigma = np.linspace(0.0, 1.0, steps + 1)
        image, depth, joints = (
            CubicSpline(sigma, values, bc_type="natural")
            for values in (path.points_px, path.depth_m, path.q)
        )
        return cls(path, SteadyLaw(steps * period_s), image, depth, joints)

    @property
    def duration(self) -> float:
        """Time from rest to rest, s."""
        return self.law.duration

    def reference(self, time: float) -> Reference:
        """Return s*, ds*/dt and depths at a time since the start, s; afterwards the goal."""
        if time > self.duration and self.desired_px is not None:
            return Reference(time, self.desired_px, depth_m=self._depth(1.0))
        sigma, speed, _ = self.law.at(time)
        return Reference(
            time=time,
            points_px=self._image(sigma),
            velocity_px=self._image(sigma, 1) * speed,
            depth_m=self._depth(sigma),
            joint_rates=self._joints(sigma, 1) * speed,
        )

    def joints(self, time: float) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return joint positions, rates and accelerations at a time, each (n,)."""
        sigma, speed, force = self.law.at(time)
        slope = self._joints(sigma, 1)
        return (
            self._joints(sigma),
            slope * speed,
            self._joints(sigma, 2) * speed**2 + slope * force,
        )


def _way(path: Path) -> float:
    """Return the length of the camera's path, m, rotation weighted by the object's distance."""
    from vergence.geometry import se3_distance

    poses, lever = path.T_world_camera, float(path.depth_m.mean())
    return float(sum(se3_distance(poses[k], poses[k + 1], lever) for k in range(len(poses) - 1)))


def _at_least_four(path: Path) -> Path:
    """Return a path with enough waypoints for a cubic spline, even if start and goal agree."""
    if len(path.q) >= 4:
        return path
    at = np.linspace(0, len(path.q) - 1, 4)
    q = np.column_stack([np.interp(at, np.arange(len(path.q)), joint) for joint in path.q.T])
    return Path.through(path.problem, q, path.planner)
