"""Motions through way-points, at rest at each of them."""

from itertools import pairwise
from typing import Annotated

import numpy as np
from numba import njit
from pydantic import Field

from vergence.arrays import FloatArray
from vergence.errors import InputError
from vergence.geometry import rpy_to_matrix, se3, se3_compose
from vergence.parts import knob, part
from vergence.simulation.motions.motion import Angle, Angles3, Vector3

_MOST_WAYPOINTS = 1000
_Time = Annotated[float, Field(ge=0, le=86400)]
_Times = Annotated[tuple[_Time, ...], Field(min_length=2, max_length=_MOST_WAYPOINTS)]


def smooth_step(share: FloatArray) -> FloatArray:
    """Return 10 s³ - 15 s⁴ + 6 s⁵, the minimum-jerk motion from rest to rest, s from 0 to 1."""
    s = np.clip(share, 0.0, 1.0)
    result: FloatArray = s**3 * (10.0 + s * (6.0 * s - 15.0))
    return result


class Waypoints:
    """Base of motions through way-points: at rest at each, minimum jerk in between."""

    times_s: tuple[float, ...]
    speed: float

    @property
    def duration_s(self) -> float:
        """Time of the last way-point, s."""
        return self.times_s[-1] / self.speed

    def through(self, values: FloatArray, times: FloatArray) -> FloatArray:
        """Return the path through way-point values (W, …) at times (K,): (K, …)."""
        knots = np.array(self.times_s) / self.speed
        leg = np.clip(np.searchsorted(knots, times, side="right") - 1, 0, len(knots) - 2)
        share = smooth_step((times - knots[leg]) / (knots[leg + 1] - knots[leg]))
        path: FloatArray = values[leg] + share[:, None] * (values[leg + 1] - values[leg])
        return path

    def _check(self, *lists: str) -> None:
        times = self.times_s
        if times[0] != 0 or any(b <= a for a, b in pairwise(times)):
            allowed = "times_s that start at 0 and increase"
            raise InputError(type(self).__name__, "times_s", list(times), allowed)
        for name in lists:
            count = len(getattr(self, name))
            if count != len(times):
                raise InputError(
                    type(self).__name__, name, f"{count} values", f"as many {name} as times_s"
                )


@part(("motion", "arm_motion"), "poses")
class PoseMotion(Waypoints):
    """An arm moves its last body or the target it carries, or a target moves independently.

    Each way-point is a pose in the start frame of the body or target.
    """

    times_s: _Times = knob(unit="s")  # times of the way-points, increasing from 0
    # One for each time.
    positions_m: Annotated[tuple[Vector3, ...], Field(max_length=_MOST_WAYPOINTS)] = knob(unit="m")
    # One for each time.
    rotations_rpy_deg: Annotated[tuple[Angles3, ...], Field(max_length=_MOST_WAYPOINTS)] = knob(
        unit="°"
    )
    speed: float = knob(1.0, least=1e-3, upto=1e3)  # speed factor; the times are divided by it

    def __post_init__(self) -> None:
        self._check("positions_m", "rotations_rpy_deg")

    def poses(self, T_start: FloatArray, times: FloatArray, seed: int = 0) -> FloatArray:
        """Return the poses (K, 4, 4)."""
        roll_pitch_yaw = np.deg2rad(self.rotations_rpy_deg)
        values = np.hstack((np.array(self.positions_m), roll_pitch_yaw[:, ::-1]))
        path = self.through(values, times)
        moved: FloatArray = _poses_along(np.array(T_start), path)
        return moved


@njit(cache=True)
def _poses_along(T_start: FloatArray, path: FloatArray) -> FloatArray:
    """Return the poses (K, 4, 4) in the world of positions, roll, pitch and yaw (K, 6) in a frame.

    Args:
        T_start: of that frame, (4, 4).
        path: (K, 6) m and rad.
    """
    poses = np.empty((len(path), 4, 4))
    for k in range(len(path)):
        poses[k] = se3_compose(T_start, se3(rpy_to_matrix(path[k, 3:]), path[k, :3]))
    return poses


@part("arm_motion", "joints")
class JointMotion(Waypoints):
    """The arm moves its joints through way-points, relative to its start."""

    times_s: _Times = knob(unit="s")  # times of the way-points, increasing from 0
    # One row for each time; m for prismatic joints.
    offsets_deg: Annotated[
        tuple[Annotated[tuple[Angle, ...], Field(max_length=64)], ...],
        Field(max_length=_MOST_WAYPOINTS),
    ] = knob(unit="°")
    speed: float = knob(1.0, least=1e-3, upto=1e3)  # speed factor; the times are divided by it

    def __post_init__(self) -> None:
        self._check("offsets_deg")
