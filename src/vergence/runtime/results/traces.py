"""Time series of a run as arrays: one row per tick or image, NaN for unknown values."""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any, Self

import numpy as np

from vergence.arrays import BoolArray, FloatArray, IntArray
from vergence.runtime.results.columns import column


class Trace:
    """Base of all traces; `time` (K,) s is their first field."""

    __slots__ = ()

    def __repr__(self) -> str:
        """How many rows there are, and of what."""
        names = ", ".join(one.name for one in fields(self))  # type: ignore[arg-type]
        return f"{type(self).__name__}({len(self.time)} rows of {names})"  # type: ignore[attr-defined]

    def at(self, rows: BoolArray | IntArray) -> Self:
        """Return some of the rows, by a mask (K,) or by indices."""
        numbers = np.arange(len(self.time))[rows]  # type: ignore[attr-defined]
        return type(self)(**{one.name: self._picked(one.name, numbers) for one in fields(self)})  # type: ignore[arg-type]

    def _picked(self, name: str, numbers: IntArray) -> Any:
        values = getattr(self, name)
        if isinstance(values, tuple):
            return tuple(values[number] for number in numbers)
        return values[numbers]


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class ArmTrace(Trace):
    """The motion of an arm with n joints over K ticks."""

    time: FloatArray = column()  # (K,) s
    position: FloatArray = column("n")  # (K, n) measured, rad or m
    velocity: FloatArray = column("n")  # (K, n) measured, rad/s or m/s
    setpoint: FloatArray = column("n")  # (K, n) the last set-points, rad or m
    setpoint_rate: FloatArray = column("n")  # (K, n) their rates, rad/s or m/s
    command: FloatArray = column("n")  # (K, n) rates asked for by the law; NaN while the arm held
    v_camera: FloatArray = column(6)  # (K, 6) camera twist of the command, m/s, rad/s
    manipulability: FloatArray = column()  # (K,) w' of [Nelson1995] eq. (26)
    penalty: FloatArray = column()  # (K,) P of [Nelson1995] eq. (27)
    active: tuple[tuple[str, ...], ...] = column(kind=tuple)  # (K,) limits that were active
    slack: tuple[Mapping[str, float], ...] = column(kind=dict)  # (K,) relaxed limits, by how much
    clearance: tuple[Mapping[str, float], ...] = column(kind=dict)  # (K,) m, smallest, by kind
    errors: tuple[Mapping[str, float], ...] = column(kind=dict)  # (K,) s - s_star of features


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class CameraTrace(Trace):
    """The observations of a camera in K images of up to M points.

    What is true is known of simulated cameras only, and NaN or false of others.
    """

    time: FloatArray = column()  # (K,) s, of exposure
    received: FloatArray = column()  # (K,) s, the tick in which the loop received the image
    points_px: FloatArray = column("M", 2)  # (K, M, 2) measured
    covariance_px: FloatArray = column("M", 2, 2)  # (K, M, 2, 2) px²
    found: BoolArray = column("M", kind=bool)  # (K, M)
    reasons: tuple[tuple[str, ...], ...] = column(kind=tuple)  # (K,) of M: why not found
    asked: BoolArray = column("M", kind=bool)  # (K, M) whether it was searched for
    window_center_px: FloatArray = column("M", 2)  # (K, M, 2) predicted; NaN if no window
    window_half_px: FloatArray = column("M", 2)  # (K, M, 2) half the sizes of the windows
    joined: IntArray = column("M", kind=int)  # (K, M) see `ImagePoints`: points of curves
    desired_px: FloatArray = column("M", 2)  # (K, M, 2)
    desired_by_pose: BoolArray = column(kind=bool)  # (K,) whether they follow from a desired pose
    T_camera_target_desired: FloatArray = column(4, 4)  # (K, 4, 4) if the task desires a pose
    true_px: FloatArray = column("M", 2)  # (K, M, 2) the true projections
    true_depth_m: FloatArray = column("M")  # (K, M) along the optical axis, m
    visible: BoolArray = column("M", kind=bool)  # (K, M) whether truly in view
    T_world_camera: FloatArray = column(4, 4)  # (K, 4, 4) true
    T_world_target: FloatArray = column(4, 4)  # (K, 4, 4) true

    @property
    def error_px(self) -> FloatArray:
        """Distance of each found point from its desired position, (K, M)."""
        return self._where_found(self.points_px - self.desired_px)

    @property
    def drift_px(self) -> FloatArray:
        """Distance of each found point from its true position, (K, M)."""
        return self._where_found(self.points_px - self.true_px)

    def _where_found(self, difference_px: FloatArray) -> FloatArray:
        distance = np.hypot(difference_px[..., 0], difference_px[..., 1])
        return np.where(self.found, distance, np.nan)


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class TargetTrace(Trace):
    """A filter's K estimates of the target's pose."""

    time: FloatArray = column()  # (K,) s, of exposure
    received: FloatArray = column()  # (K,) s, the tick in which the loop received the image
    T_world_target: FloatArray = column(4, 4)  # (K, 4, 4)
    velocity: FloatArray = column(6)  # (K, 6) m/s and rad/s, world axes
    covariance: FloatArray = column(12, 12)  # (K, 12, 12)
    consistent: BoolArray = column(kind=bool)  # (K,)


def largest(distances: FloatArray) -> FloatArray:
    """Return the largest distance of each row of (K, M), (K,); NaN in a row without any."""
    known = np.isfinite(distances)
    worst = np.where(known, distances, -np.inf).max(axis=1, initial=-np.inf)
    return np.where(known.any(axis=1), worst, np.nan)
