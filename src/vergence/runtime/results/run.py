"""What a run was."""

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

UNDER_ACTUATED = "under-actuated"  # the event that tells which directions an arm cannot serve
FREE_DIRECTIONS = "free directions"  # the event that tells what the objectives leave free
POOR_AXES = "poor axes"  # the event that tells which axes of a law hardly move its features
# Events that advise a person, and what the table of a run calls them.
ADVICE = {
    UNDER_ACTUATED: "unserved directions",
    POOR_AXES: POOR_AXES,
    FREE_DIRECTIONS: FREE_DIRECTIONS,
}


@dataclass(frozen=True, slots=True)
class Event:
    """Something that happened once."""

    time: float  # s since the start of the run
    name: str  # the same for every event of a kind
    text: str  # one sentence for a person


@dataclass(frozen=True, slots=True, eq=False)
class Run:
    """What a run was: how it ended and all its numbers; images are not kept."""

    info: RunInfo  # the cell, its seed, and the arms and cameras in it
    arms: Mapping[str, ArmTrace]  # arms, by name
    cameras: Mapping[str, CameraTrace]  # cameras, by name
    target: TargetTrace | None  # as a filter believed it; None where no filter ran
    events: tuple[Event, ...]  # in order of time
    outcome: Outcome
    summary: Mapping[str, float]  # the few numbers that say how it went
    # Targets that the task was not about, by name.
    others: Mapping[str, OtherTarget]

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

    @property
    def pose_errors(self) -> PoseErrors:
        """Errors of the estimated pose, and of the task's camera, against the truth."""
        return pose_errors(self.target, self.cameras, self.info.task_camera)

    def to_frame(self, of: str | None = None) -> "pd.DataFrame":
        """Return the numbers as a pandas table; needs pandas.

        Args:
            of: the name of an arm or a camera, "target", or "target NAME" of another: all that is
                known of it, one row per tick, image or estimate. Without it, one row per tick,
                with everything but matrices.

        Raises:
            InputError: if there is nothing of that name, or pandas is not installed.
        """
        from vergence.runtime.results.data_frame import data_frame

        return data_frame(self, of)

    def save(self, path: str | Path) -> None:
        """Save the numbers as a NumPy archive of arrays such as ``puma.position``; `np.load` it."""
        from vergence.runtime.results.data_frame import named_arrays

        np.savez_compressed(path, allow_pickle=False, **named_arrays(self))
