"""Pose errors of a filter's estimate and of a camera, against the ground truth of a simulation."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from vergence.arrays import BoolArray, FloatArray, IntArray
from vergence.geometry import angle_between
from vergence.runtime.results.columns import Columns
from vergence.runtime.results.tick_rows import camera_row, images_of, target_row
from vergence.runtime.results.traces import CameraTrace, TargetTrace
from vergence.runtime.run_info import RunInfo
from vergence.runtime.tick import TickRecord


class PoseErrors(NamedTuple):
    """Errors at the exposures of K images; no rows if there is no pose estimate or no ground truth.

    Errors of the camera are NaN where it took no image at that time, or no pose is desired in it.
    """

    time: FloatArray  # (K,) s, of exposure
    T_world_target: FloatArray  # (K, 4, 4) the truth
    target_m: FloatArray  # (K, 3) estimated less true position, along world axes
    target_rad: FloatArray  # (K,) angle between estimated and true orientation
    camera_m: FloatArray  # (K, 3) true less desired position of the target, in the camera's axes
    camera_rad: FloatArray  # (K,) angle between its true and desired orientation in the camera

    def between(self, start: float, end: float = np.inf) -> "PoseErrors":
        """Return the rows from a start to an end time, s."""
        rows = (self.time >= start) & (self.time <= end)
        return PoseErrors(*(values[rows] for values in self))


def pose_errors(
    target: TargetTrace | None, cameras: Mapping[str, CameraTrace], camera: str
) -> PoseErrors:
    """Compare a filter's estimates with the ground truth at the exposure of its newest image.

    Args:
        target: the estimates, if a filter ran.
        cameras: every camera's trace, by name.
        camera: the one whose pose relative to the target is desired.
    """
    if target is None:
        none = np.empty(0)
        return PoseErrors(none, np.empty((0, 4, 4)), np.empty((0, 3)), none, np.empty((0, 3)), none)
    T_true = np.full_like(target.T_world_target, np.nan)
    for trace in cameras.values():
        at, rows = _exposed_at(trace, target.time)
        at &= np.isnan(T_true[:, 0, 0])
        T_true[at] = trace.T_world_target[rows[at]]
    known = np.isfinite(T_true[:, 0, 0])
    time, T_true, T_believed = target.time[known], T_true[known], target.T_world_target[known]
    return PoseErrors(
        time,
        T_true,
        T_believed[:, :3, 3] - T_true[:, :3, 3],
        _angles(T_believed, T_true),
        *_camera_errors(cameras.get(camera), time),
    )


def tick_pose_errors(record: TickRecord, info: RunInfo) -> PoseErrors:
    """Return the pose errors of one tick, in at most one row.

    Args:
        record: of the tick.
        info: of the run.
    """
    target = None if record.observation is None else record.observation.target
    believed = Columns(TargetTrace)
    if target is not None:
        believed.append(target_row(record, target))
    seen = {name: Columns(CameraTrace) for name in info.cameras}
    for frame, view in images_of(record):
        row = camera_row(record, info, frame, view)
        seen[row["camera"]].append(row)
    cameras = {name: columns.table() for name, columns in seen.items()}
    return pose_errors(believed.table(), cameras, info.task_camera)


def _angles(T_a: FloatArray, T_b: FloatArray) -> FloatArray:
    return np.array([angle_between(a, b) for a, b in zip(T_a, T_b, strict=True)])


def _camera_errors(trace: CameraTrace | None, time: FloatArray) -> tuple[FloatArray, FloatArray]:
    metres, radians = np.full((len(time), 3), np.nan), np.full(len(time), np.nan)
    if trace is None or not len(trace.time):
        return metres, radians
    at, rows = _exposed_at(trace, time)
    at &= np.isfinite(trace.T_camera_target_desired[rows, 0, 0])
    rows = rows[at]
    T_camera_target = np.linalg.inv(trace.T_world_camera[rows]) @ trace.T_world_target[rows]
    desired = trace.T_camera_target_desired[rows]
    metres[at] = T_camera_target[:, :3, 3] - desired[:, :3, 3]
    radians[at] = _angles(T_camera_target, desired)
    return metres, radians


def _exposed_at(trace: CameraTrace, time: FloatArray) -> tuple[BoolArray, IntArray]:
    """Return which times have an image with ground truth, and in which row, (K,)."""
    known = np.flatnonzero(np.isfinite(trace.T_world_target[:, 0, 0]))
    if not len(known):
        return np.zeros(len(time), dtype=np.bool_), np.zeros(len(time), dtype=np.int64)
    exposed = trace.time[known]
    nearest = np.minimum(np.searchsorted(exposed, time), len(known) - 1)
    at: BoolArray = exposed[nearest] == time
    return at, known[nearest]
