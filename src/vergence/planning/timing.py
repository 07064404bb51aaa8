"""When a path is where: a time law with continuous acceleration inside rate and force limits."""

from dataclasses import dataclass

import numpy as np

from vergence.arrays import FloatArray
from vergence.geometry import se3_distance
from vergence.planning.path import Path

RAMPS = (0.08, 0.12, 0.18, 0.25, 0.35, 0.5)  # parts of the duration tried for speeding up
SPREAD = 4  # waypoints either side over which the pace is evened out


@dataclass(frozen=True, slots=True)
class TimeLaw:
    """Place σ along a path of length 1 at time t: speed up, cruise, slow down.

    The speed ramps as 3x² - 2x³, so that σ(t) is C² and rests at both ends.
    """

    duration: float  # s
    ramp: float  # part of the duration spent speeding up, and again slowing down, at most a half

    def at(self, time: float | FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return σ, dσ/dt and d²σ/dt² at times in s; outside the duration the path rests."""
        t = np.clip(np.asarray(time, dtype=np.float64) / self.duration, 0.0, 1.0)
        late = t > 0.5
        x = np.minimum(np.where(late, 1.0 - t, t) / self.ramp, 1.0)
        cruise = 1.0 / (1.0 - self.ramp)  # speed per duration, for a way of 1
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
    """Place σ = t/duration: [Mezouar2001] section 4 with t_k = kT, at one speed from the start."""

    duration: float  # s

    def at(self, time: float | FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return σ, dσ/dt and d²σ/dt² at times in s; outside the duration the path rests."""
        t = np.asarray(time, dtype=np.float64) / self.duration
        moving = (t >= 0.0) & (t < 1.0)
        return np.clip(t, 0.0, 1.0), moving / self.duration, np.zeros_like(t)


def pace(path: Path, camera_speed: float) -> FloatArray:
    """Return the place σ in [0, 1] of each waypoint, (K,): equal steps take equal time.

    A step takes as long as its slowest part: the joint that is nearest to its rate limit, or the
    camera at its speed, its turning weighed with the distance of the object. The paper spaces by
    ‖ΔΥ‖, which jumps where the angle passes half a turn; a distance on SE(3) does not.

    Args:
        path: of K waypoints.
        camera_speed: m/s that the camera, and the object's image of it, may move at.
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
    """Return steps blurred by a triangle, and nowhere shorter than a tenth of the mean."""
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
    """Return the shortest of the laws whose rates and accelerations keep their limits.

    With q̇ = q' σ̇ and q̈ = q' σ̈ + q'' σ̇², stretching time by k divides rates by k and
    accelerations by k²; each ramp is stretched until its worst instant is at a limit.

    Args:
        first: q' at equally spaced σ from 0 to 1, (M, n).
        second: q'' at the same places, (M, n).
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
