"""Observations of targets other than the task's."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

from vergence.runtime.results.pose_errors import PoseErrors, pose_errors
from vergence.runtime.results.traces import CameraTrace, TargetTrace
from vergence.runtime.tick import TickRecord


@dataclass(frozen=True, slots=True, eq=False)
class OtherTarget:
    """Observations of a target while it was not the task's."""

    cameras: Mapping[str, CameraTrace]  # its points in the images, by camera name
    target: TargetTrace | None  # filter estimate; None where none ran

    @property
    def pose_errors(self) -> PoseErrors:
        """Errors of the estimated pose against the truth; no pose is desired."""
        return pose_errors(self.target, self.cameras, "")


def other_names(record: TickRecord) -> tuple[str, ...]:
    """Return the names of the targets in a tick other than the task's."""
    names = dict.fromkeys(record.observation.others if record.observation else ())
    for frame in record.sample.frames:
        names |= dict.fromkeys(frame.truth.others if frame.truth else ())
    return tuple(names)


def about_other(record: TickRecord, name: str) -> TickRecord:
    """Return a tick as if it were about another target, without desired values."""
    frames = tuple(
        replace(frame, truth=None if frame.truth is None else frame.truth.others.get(name))
        for frame in record.sample.frames
    )
    return replace(
        record,
        sample=replace(record.sample, frames=frames),
        observation=record.observation.others.get(name) if record.observation else None,
        reference=None,
    )
