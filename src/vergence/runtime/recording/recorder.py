"""Records a run in its folder while it happens."""

from collections.abc import Mapping
from pathlib import Path

from vergence.runtime.recording.mcap_writer import McapWriter
from vergence.runtime.run_info import RunInfo
from vergence.runtime.tick import TickRecord
from vergence.signals import Outcome


class Recorder:
    """A listener that records the run as MCAP; `Recording` reads it back."""

    def __init__(self, folder: str | Path, image_every: int = 2, jpeg_quality: int = 85) -> None:
        """Set what to record and where; nothing is written before the run begins.

        Args:
            folder: the run folder; if it exists, a recording in it is replaced.
            image_every: record every n-th image of each camera; 0 records none.
            jpeg_quality: 0 to 100.
        """
        self.folder = Path(folder)
        self._image_every = image_every
        self._jpeg_quality = jpeg_quality
        self._writer: McapWriter | None = None

    @property
    def running(self) -> bool:
        """Whether a run has begun and not ended."""
        return self._writer is not None

    @property
    def now(self) -> float:
        """Time of the last record, s."""
        return self._writer.now if self._writer else 0.0

    def begin(self, info: RunInfo) -> None:
        """Create the folder and start the file."""
        self._writer = McapWriter(self.folder, info, self._image_every, self._jpeg_quality)

    def tick(self, record: TickRecord) -> None:
        """Record one turn of the loop."""
        assert self._writer is not None, "a run begins before it ticks"
        self._writer.tick(record)

    def event(self, time: float, name: str, text: str) -> None:
        """Record a single event."""
        assert self._writer is not None, "a run begins before anything happens in it"
        self._writer.event(time, name, text)

    def close(self, outcome: Outcome, summary: Mapping[str, float | str]) -> None:
        """Record the end and close the file; a second call does nothing."""
        writer, self._writer = self._writer, None
        if writer is not None:
            writer.close(outcome, summary)
