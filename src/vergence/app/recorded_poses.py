"""Where the arms and the target of a recording were, at any of its instants."""

from typing import TypeAlias

import numpy as np

from vergence.arrays import FloatArray
from vergence.cell.named_targets import TARGET
from vergence.runtime.recording import Recording
from vergence.runtime.results import CameraTrace

_AT_ONCE_S = 1e-9
_Series: TypeAlias = tuple[FloatArray, FloatArray]  # times (K,) s, and poses then (K, 4, 4)


class RecordedPoses:
    """Looks up joints and targets in a recording.

    Args:
        recording: of the run.

    Attributes:
        true_times: when the true pose of the task's target is known, (K,) s.
        true_poses: T_world_target then, (K, 4, 4).
    """

    def __init__(self, recording: Recording) -> None:
        self._recording = recording
        self.true_times, self.true_poses = _in_order(*_true(_task_camera(recording)))
        names = recording.info.targets or (TARGET,)
        self._targets = {name: _poses(recording, name) for name in names}

    def joints(self, time: float) -> dict[str, FloatArray]:
        """Return the joint positions (n,) of every arm that was measured, rad or m."""
        return {
            name: trace.position[newest(trace.time, time)]
            for name, trace in self._recording.arms.items()
            if len(trace.time)
        }

    def targets(self, time: float) -> dict[str, FloatArray]:
        """Return T_world_target (4, 4) by name: true, else as a filter believed it, if either."""
        return {
            name: poses[newest(times, time)]
            for name, (times, poses) in self._targets.items()
            if len(times)
        }


def newest(times: FloatArray, time: float) -> int:
    """Return the place of the last of increasing times that is not later; the first at least."""
    return max(int(np.searchsorted(times, time + _AT_ONCE_S, side="right")) - 1, 0)


def _poses(recording: Recording, name: str) -> _Series:
    """Return the poses of a target, true ones if there are any, else those of its filter.

    What is recorded as the task's target is this one's wherever this one is not recorded beside it.
    """
    task, other = _task_camera(recording), recording.others.get(name)
    beside = [] if other is None else list(other.cameras.values())
    others = np.concatenate([np.empty(0), *(trace.time for trace in beside)])
    own = None if task is None else task.at(~np.isin(task.time, others))
    true = [_true(trace) for trace in (own, *beside)]
    if any(len(times) for times, _ in true):
        return _in_order(*map(np.concatenate, zip(*true, strict=True)))
    served, estimate = recording.target, None if other is None else other.target
    own_estimate = None if served is None else served.at(~np.isin(served.time, others))
    known = [trace for trace in (own_estimate, estimate) if trace is not None]
    times = np.concatenate([np.empty(0), *(trace.time for trace in known)])
    poses = np.concatenate([np.empty((0, 4, 4)), *(trace.T_world_target for trace in known)])
    return _in_order(times, poses)


def _task_camera(recording: Recording) -> CameraTrace | None:
    """Return the trace of the camera that shows the target: another may look at a tool."""
    return recording.cameras.get(recording.info.task_camera)


def _true(trace: CameraTrace | None) -> _Series:
    if trace is None:
        return np.empty(0), np.empty((0, 4, 4))
    known = np.isfinite(trace.T_world_target).all(axis=(1, 2))
    return trace.time[known], trace.T_world_target[known]


def _in_order(times: FloatArray, poses: FloatArray) -> _Series:
    order = np.argsort(times, kind="stable")
    return times[order], poses[order]
