"""The result of a run."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from vergence.arrays import FloatArray
from vergence.runtime.results.other_target import OtherTarget
from vergence.runtime.results.pose_errors import PoseErrors, pose_errors
from vergence.runtime.results.traces import ArmTrace, CameraTrace, TargetTrace
from vergence.runtime.run_info import RunInfo
from vergence.signals import Outcome

if TYPE_CHECKING:
    import pandas as pd

UNDER_ACTUATED = "under-actuated"  # event that names the directions in which an arm cannot move
FREE_DIRECTIONS = "free directions"  # event that names what the objectives leave undetermined
POOR_AXES = "poor axes"  # event that names axes along which the features hardly change
# Events that advise the user, with their names in the table of a run.
ADVICE = {
    UNDER_ACTUATED: "unserved directions",
    POOR_AXES: POOR_AXES,
    FREE_DIRECTIONS: FREE_DIRECTIONS,
}


@dataclass(frozen=True, slots=True)
class Event:
    """A single event."""

    time: float  # s since the start of the run
    name: str  # the same for every event of a kind
    text: str  # one sentence for the user


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Run:
    """The result of a run: its outcome and all its numbers; images are not kept."""

    info: RunInfo  # the cell, its seed, and the arms and cameras in it
    arms: Mapping[str, ArmTrace]  # arms, by name
    cameras: Mapping[str, CameraTrace]  # cameras, by name
    target: TargetTrace | None  # filter estimates; None if no filter ran
    events: tuple[Event, ...]  # in order of time
    outcome: Outcome
    summary: Mapping[str, float]  # the key figures of the run
    # Targets other than the task's, by name.
    others: Mapping[str, OtherTarget]

    def __repr__(self) -> str:
        """How it ended, and whose numbers it has."""
        arms, cameras = ", ".join(self.arms), ", ".join(self.cameras)
        what = f"{type(self).__name__}({self.info.cell}: {self.outcome}"
        return f"{what}; arms: {arms or 'none'}; cameras: {cameras or 'none'})"

    @property
    def times(self) -> FloatArray:
        """Times of the ticks, (K,) s."""
        return next(iter(self.arms.values())).time if self.arms else np.empty(0)

    @property
    def duration(self) -> float:
        """Time of the last tick, s."""
        arms = (trace.time for trace in self.arms.values())
        cameras = (trace.received for trace in self.cameras.values())
        return max((float(time[-1]) for time in (*arms, *cameras) if len(time)), default=0.0)

    def seen_by(self, camera: str) -> list[CameraTrace]:
        """Return what a camera observed of each target in at least one image, the task's first."""
        of_each = (self.cameras, *(other.cameras for other in self.others.values()))
        return [traces[camera] for traces in of_each if len(traces[camera].time)]

    @property
    def pose_errors(self) -> PoseErrors:
        """Errors of the estimated pose, and of the task's camera, against the truth."""
        return pose_errors(self.target, self.cameras, self.info.task_camera)

    def to_frame(self, of: str | None = None) -> "pd.DataFrame":
        """Return the numbers as a pandas table; needs pandas.

        Args:
            of: the name of an arm or a camera, "target", or "target NAME" for another target: all
                its data, one row per tick, image or estimate. If None, one row per tick with
                everything but matrices.

        Raises:
            InputError: if nothing has that name, or pandas is not installed.
        """
        from vergence.runtime.results.data_frame import data_frame

        return data_frame(self, of)

    def save(self, path: str | Path) -> None:
        """Save the numbers as a NumPy archive of arrays such as ``puma.position``; `np.load` it."""
        from vergence.runtime.results.data_frame import named_arrays

        np.savez_compressed(path, allow_pickle=False, **named_arrays(self))
