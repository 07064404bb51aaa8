"""The timing of a path: a law with continuous acceleration within rate and acceleration limits."""

from dataclasses import dataclass

import numpy as np

from vergence.arrays import FloatArray
from vergence.geometry import se3_distance
from vergence.planning.path import Path

RAMPS = (0.08, 0.12, 0.18, 0.25, 0.35, 0.5)  # fractions of the duration tried for acceleration
SPREAD = 4  # waypoints on either side over which the pace is smoothed


@dataclass(frozen=True, slots=True)
class TimeLaw:
    """Position σ on a path of length 1 at time t: accelerate, cruise, decelerate.

    The speed ramps as 3x² - 2x³, so that σ(t) is C² and at rest at both ends.
    """

    duration: float  # s
    ramp: float  # fraction of the duration to accelerate, and again to decelerate, at most a half

    def at(self, time: float | FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return σ, dσ/dt and d²σ/dt² at times in s; at rest before 0 and after the duration."""
        t = np.clip(np.asarray(time, dtype=np.float64) / self.duration, 0.0, 1.0)
        late = t > 0.5
        x = np.minimum(np.where(late, 1.0 - t, t) / self.ramp, 1.0)
        cruise = 1.0 / (1.0 - self.ramp)  # speed times duration, for a path of length 1
        ramped = self.ramp * (x**3 - 0.5 * x**4)
        way = cruise * (ramped + np.maximum(np.where(late, 1.0 - t, t) - self.ramp, 0.0))
        speed = cruise * (3 * x**2 - 2 * x**3)
        force = cruise / self.ramp * 6 * (x - x**2)
        return (
            np.where(late, 1.0 - way, way),
            speed / self.duration,
            np.where(late, -force, force) / self.duration**2,
        )


@dataclass(frozen=True, slots=True)
class SteadyLaw:
    """Position σ = t/duration: [Mezouar2001] section 4 with t_k = kT, at a constant speed."""

    duration: float  # s

    def at(self, time: float | FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return σ, dσ/dt and d²σ/dt² at times in s; at rest before 0 and after the duration."""
        t = np.asarray(time, dtype=np.float64) / self.duration
        moving = (t >= 0.0) & (t < 1.0)
        return np.clip(t, 0.0, 1.0), moving / self.duration, np.zeros_like(t)


def pace(path: Path, camera_speed: float) -> FloatArray:
    """Return the position σ in [0, 1] of each waypoint, (K,): equal steps take equal time.

    A step takes as long as its slowest part: the joint closest to its rate limit, or the camera at
    its speed, with rotation weighted by the distance of the object. The paper spaces waypoints by
    ‖ΔΥ‖, which jumps where the angle passes half a turn; a distance on SE(3) does not.

    Args:
        path: of K waypoints.
        camera_speed: largest speed of the camera, and of the object relative to it, m/s.
    """
    poses, lever = path.T_world_camera, float(path.depth_m.mean())
    by_joint = (np.abs(np.diff(path.q, axis=0)) / path.problem.arm.rate_max).max(axis=1)
    steps = range(len(poses) - 1)
    by_camera = np.array([se3_distance(poses[k], poses[k + 1], lever) for k in steps])
    needed = np.maximum(by_joint, by_camera / camera_speed)
    taken = _evened(needed) + 1e-9
    at = np.concatenate(([0.0], np.cumsum(taken)))
    result: FloatArray = at / at[-1]
    return result


def _evened(steps: FloatArray) -> FloatArray:
    """Return steps smoothed by a triangular filter, none shorter than a tenth of the mean."""
    width = min(SPREAD, len(steps) - 1)
    if width < 1:
        return steps
    kernel = np.concatenate((np.arange(1, width + 2), np.arange(width, 0, -1))).astype(np.float64)
    padded = np.pad(steps, width, mode="edge")
    blurred: FloatArray = np.convolve(padded, kernel / kernel.sum(), mode="valid")
    return np.asarray(np.maximum(blurred, 0.1 * blurred.mean()))


def fastest_law(
    first: FloatArray, second: FloatArray, rate_max: FloatArray, acceleration_max: FloatArray
) -> TimeLaw:
    """Return the shortest of the laws within the rate and acceleration limits.

    With q̇ = q' σ̇ and q̈ = q' σ̈ + q'' σ̇², stretching time by k divides rates by k and
    accelerations by k²; each ramp is stretched until its worst instant is at a limit.

    Args:
        first: q' at equally spaced σ from 0 to 1, (M, n).
        second: q'' at the same positions, (M, n).
        rate_max: (n,) per s.
        acceleration_max: (n,) per s².
    """
    laws = []
    places = np.linspace(0.0, 1.0, len(first))
    for ramp in RAMPS:
        sigma, speed, force = TimeLaw(1.0, ramp).at(np.linspace(0.0, 1.0, 4 * len(first)))
        q1 = np.column_stack([np.interp(sigma, places, column) for column in first.T])
        q2 = np.column_stack([np.interp(sigma, places, column) for column in second.T])
        rates = np.abs(q1 * speed[:, None]) / rate_max
        forces = np.abs(q1 * force[:, None] + q2 * speed[:, None] ** 2) / acceleration_max
        laws.append(TimeLaw(max(float(rates.max()), float(forces.max()) ** 0.5, 1e-3), ramp))
    return min(laws, key=lambda law: law.duration)
