"""The newest image of each camera of a run."""

from collections.abc import Mapping

from vergence.runtime import RunInfo, TickRecord
from vergence.signals import Frame, Outcome


class NewestFrames:
    """A listener that keeps the newest image of each camera.

    Attributes:
        frames: by the camera's name; times are those of the run.
    """

    def __init__(self) -> None:
        self.frames: dict[str, Frame] = {}

    def begin(self, info: RunInfo) -> None:
        """Take note of nothing."""

    def tick(self, record: TickRecord) -> None:
        """Keep what arrived."""
        self.frames |= {frame.camera: frame for frame in record.sample.frames}

    def event(self, time: float, name: str, text: str) -> None:
        """Take note of nothing."""

    def close(self, outcome: Outcome, summary: Mapping[str, float | str]) -> None:
        """Keep what there is: a goal may be taken, or points picked, after the end of a run."""
