"""What a recording says over time, as arrays: a row a tick, NaN where nothing is known."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from vergence.arrays import BoolArray, FloatArray
from vergence.runtime.recording.numbers import array

Row = dict[str, Any]  # one message of a numeric stream


@dataclass(frozen=True, slots=True)
class ArmTrace:
    """How an arm with n joints moved in K ticks."""

    time: FloatArray  # (K,) s
    position: FloatArray  # (K, n) rad or m
    velocity: FloatArray  # (K, n) rad/s or m/s
    command: FloatArray  # (K, n) commanded rates; NaN while the arm held
    v_camera: FloatArray  # (K, 6) the camera twist the command was made from, m/s and rad/s
    manipulability: FloatArray  # (K,) w' of [Nelson1995] eq. (26)
    penalty: FloatArray  # (K,) P of [Nelson1995] eq. (27)
    active: tuple[tuple[str, ...], ...]  # (K,) constraints that shaped the command
    slack: tuple[Mapping[str, float], ...]  # (K,) those that bent, and by how much


@dataclass(frozen=True, slots=True)
class CameraTrace:
    """What a camera saw in K pictures of up to M points."""

    time: FloatArray  # (K,) s, of exposure
    received: FloatArray  # (K,) s, when the loop had the picture
    points_px: FloatArray  # (K, M, 2) measured
    covariance_px: FloatArray  # (K, M, 2, 2) px²
    found: BoolArray  # (K, M)
    reasons: tuple[tuple[str, ...], ...]  # (K,) of M: why not found
    asked: BoolArray  # (K, M) whether it was looked for
    window_center_px: FloatArray  # (K, M, 2) predicted places; NaN without a window
    window_half_px: FloatArray  # (K, M, 2) half the sizes of the windows
    desired_px: FloatArray  # (K, M, 2)
    true_px: FloatArray  # (K, M, 2) truly projected, from a simulated camera
    T_camera_target_wanted: FloatArray  # (K, 4, 4)
    T_world_camera: FloatArray  # (K, 4, 4) true
    T_world_target: FloatArray  # (K, 4, 4) true

    @property
    def error_px(self) -> FloatArray:
        """Distance of each found point from where it should be, (K, M)."""
        return self._where_found(self.points_px - self.desired_px)

    @property
    def drift_px(self) -> FloatArray:
        """Distance of each found point from where it truly is, (K, M)."""
        return self._where_found(self.points_px - self.true_px)

    def _where_found(self, difference_px: FloatArray) -> FloatArray:
        distance = np.hypot(difference_px[..., 0], difference_px[..., 1])
        return np.where(self.found, distance, np.nan)


@dataclass(frozen=True, slots=True)
class TargetTrace:
    """Where a filter believed the target to be, K times."""

    time: FloatArray  # (K,) s
    T_world_target: FloatArray  # (K, 4, 4)
    velocity: FloatArray  # (K, 6) m/s and rad/s, world axes
    covariance: FloatArray  # (K, 12, 12)
    consistent: BoolArray  # (K,)


def arm_trace(rows: Sequence[Row], joints: int) -> ArmTrace:
    """Stack the messages of an arm."""
    return ArmTrace(
        time=_column(rows, "time"),
        position=_stack(rows, "position", joints),
        velocity=_stack(rows, "velocity", joints),
        command=_stack(rows, "command", joints),
        v_camera=_stack(rows, "v_camera", 6),
        manipulability=_column(rows, "manipulability"),
        penalty=_column(rows, "penalty"),
        active=tuple(tuple(row.get("active", ())) for row in rows),
        slack=tuple(
            dict(zip(row.get("slack", ()), array(row.get("slack_by", ())).tolist(), strict=False))
            for row in rows
        ),
    )


def camera_trace(rows: Sequence[Row]) -> CameraTrace:
    """Stack the messages of a camera; points are matched by their place in the list."""
    widest = max((_length(row) for row in rows), default=0)
    count = len(rows)
    return CameraTrace(
        time=_column(rows, "time"),
        received=_column(rows, "received"),
        points_px=_points(rows, "", widest),
        covariance_px=_stack(rows, "covariance", 4 * widest).reshape(count, widest, 2, 2),
        found=_stack(rows, "found", widest) == 1.0,
        reasons=tuple(tuple(row.get("reasons", ())[:widest]) for row in rows),
        asked=_asked(rows, widest),
        window_center_px=_points(rows, "window_", widest),
        window_half_px=_points(rows, "window_half_", widest),
        desired_px=_points(rows, "desired_", widest),
        true_px=_points(rows, "true_", widest),
        T_camera_target_wanted=_poses(rows, "T_camera_target_wanted"),
        T_world_camera=_poses(rows, "T_world_camera"),
        T_world_target=_poses(rows, "T_world_target"),
    )


def target_trace(rows: Sequence[Row]) -> TargetTrace:
    """Stack the messages of a filter."""
    return TargetTrace(
        time=_column(rows, "time"),
        T_world_target=_poses(rows, "T_world_target"),
        velocity=_stack(rows, "velocity", 6),
        covariance=_stack(rows, "covariance", 144).reshape(len(rows), 12, 12),
        consistent=np.array([row.get("consistent", False) for row in rows], dtype=np.bool_),
    )


def _length(row: Row) -> int:
    """Return how many points a message speaks of."""
    return max(len(row.get(key, ())) for key in ("u", "desired_u", "true_u"))


def _asked(rows: Sequence[Row], width: int) -> BoolArray:
    """Return which points were looked for: those with a window, and all where there are none."""
    out = np.zeros((len(rows), width), dtype=np.bool_)
    for place, row in zip(out, rows, strict=True):
        found: list[Any] = row.get("found", [])[:width]
        halves: list[Any] = row.get("window_half_u", found)[: len(found)]
        place[: len(halves)] = [half is not None for half in halves]
    return out


def _column(rows: Sequence[Row], key: str) -> FloatArray:
    return array([row.get(key) for row in rows])


def _stack(rows: Sequence[Row], key: str, width: int) -> FloatArray:
    """Return one row of `width` numbers a message: NaN where it has fewer, the first if more."""
    out = np.full((len(rows), width), np.nan)
    for place, row in zip(out, rows, strict=True):
        values = row.get(key, ())[:width]
        place[: len(values)] = array(values)
    return out


def _points(rows: Sequence[Row], prefix: str, width: int) -> FloatArray:
    columns = [_stack(rows, prefix + axis, width) for axis in ("u", "v")]
    return np.stack(columns, axis=-1)


def _poses(rows: Sequence[Row], key: str) -> FloatArray:
    return _stack(rows, key, 16).reshape(len(rows), 4, 4)
