"""Where the arms and the target of a recording were, at any of its instants."""

import numpy as np

from vergence.arrays import FloatArray
from vergence.runtime.recording import Recording

_AT_ONCE_S = 1e-9


class RecordedPoses:
    """Looks up joints and target in a recording.

    Args:
        recording: of the run.

    Attributes:
        true_times: when the target's true pose is known, (K,) s.
        true_poses: T_world_target then, (K, 4, 4).
    """

    def __init__(self, recording: Recording) -> None:
        self._recording = recording
        self.true_times, self.true_poses = _true_poses(recording)

    def joints(self, time: float) -> dict[str, FloatArray]:
        """Return the joint positions (n,) of every arm that was measured, rad or m."""
        return {
            name: trace.position[newest(trace.time, time)]
            for name, trace in self._recording.arms.items()
            if len(trace.time)
        }

    def target(self, time: float) -> FloatArray | None:
        """Return T_world_target (4, 4): true, else as a filter believed it; None without either."""
        estimate = self._recording.target
        if len(self.true_times):
            pose: FloatArray = self.true_poses[newest(self.true_times, time)]
        elif estimate is not None:
            pose = estimate.T_world_target[newest(estimate.time, time)]
        else:
            return None
        return pose


def newest(times: FloatArray, time: float) -> int:
    """Return the place of the last of increasing times that is not later; the first at least."""
    return max(int(np.searchsorted(times, time + _AT_ONCE_S, side="right")) - 1, 0)


def _true_poses(recording: Recording) -> tuple[FloatArray, FloatArray]:
    trace = recording.cameras.get(recording.info.task_camera)  # another may look at a tool
    if trace is None:
        return np.empty(0), np.empty((0, 4, 4))
    times, poses = trace.time, trace.T_world_target
    known = np.isfinite(poses).all(axis=(1, 2))
    order = np.argsort(times[known], kind="stable")
    return times[known][order], poses[known][order]
