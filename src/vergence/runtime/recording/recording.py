"""Reads a run back from its folder."""

from collections.abc import Container, Iterator, Mapping
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import Annotated, Any, Self

import numpy as np
from pydantic import ConfigDict, Field, StringConstraints, TypeAdapter

from vergence.arrays import FloatArray, ImageArray
from vergence.errors import InputError, echo
from vergence.places import find_recording
from vergence.runtime.recording import streams, wire
from vergence.runtime.recording.checked_messages import checked_messages
from vergence.runtime.recording.mcap_contents import McapContents, messages_on
from vergence.runtime.recording.outcome_json import read_outcome
from vergence.runtime.recording.streams import row_of
from vergence.runtime.results import (
    ArmTrace,
    CameraTrace,
    Columns,
    Event,
    OtherTarget,
    Run,
    TargetTrace,
)
from vergence.runtime.results.columns import Table
from vergence.runtime.run_info import RunInfo
from vergence.signals import Outcome, OutcomeKind

_IMAGES = "/image"  # suffix of the topics that are read one by one
_MOST_EVENTS = 100_000
_LONGEST_TEXT = 1000  # characters
_Text = Annotated[str, StringConstraints(max_length=_LONGEST_TEXT)]
_SUMMARY: TypeAdapter[dict[str, float | str | None]] = TypeAdapter(
    Annotated[dict[_Text, float | _Text | None], Field(max_length=1000)],
    config=ConfigDict(allow_inf_nan=False),
)


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Recording(Run):
    """A run read from its folder, with the recorded images; `Recording.open` reads one.

    The outcome of a recording that ends without one is *cut off*.
    """

    path: Path  # of the file
    version: str  # of vergence at the time of recording
    complete: bool  # whether the file has a proper end
    skipped: int  # messages that could not be read

    @classmethod
    def open(cls, run: str | Path) -> Self:
        """Read a recording, up to where it was cut off if it was.

        Args:
            run: the run folder, or the recording itself.

        Raises:
            InputError: if there is no recording, or it was not written by vergence.
        """
        path = find_recording(run)
        contents = McapContents.read(path, leave_out=_IMAGES)
        info, version = _introduction(path, contents)
        read = _Messages(contents)
        arms = {
            name: read.table(f"/arm/{name}/state", streams.ARM_SCHEMA, ArmTrace, len(arm.names))
            for name, arm in info.arms.items()
        }
        cameras, target = read.seen("", info)
        others = {name: read.seen(f"/target/{name}", info) for name in info.targets}
        outcome, summary = _end(contents.metadata.get("outcome"))
        ends = [float(trace.time[-1]) for trace in arms.values() if len(trace.time)]
        return cls(
            info=info,
            arms=arms,
            cameras=cameras,
            target=target,
            events=read.events(),
            outcome=outcome or _cut_off(max(ends, default=0.0)),
            summary=summary,
            others={name: OtherTarget(*seen) for name, seen in others.items() if _any(*seen)},
            path=path,
            version=version,
            complete=contents.complete and outcome is not None,
            skipped=read.skipped,
        )

    @property
    def folder(self) -> Path:
        """The run folder."""
        return self.path.parent

    def image_times(self, camera: str) -> FloatArray:
        """Return when the recorded images of a camera were exposed, (P,) s."""
        return np.array([time for time, _ in self.jpegs(camera)])

    def images(
        self, camera: str, only: Container[int] | None = None
    ) -> Iterator[tuple[float, ImageArray]]:
        """Yield the recorded images of a camera with their times of exposure, in order.

        Args:
            camera: its name.
            only: indices of the images to yield; all if None. The others are not decoded.
        """
        size = self.info.cameras[camera]
        for number, (time, jpeg) in enumerate(self.jpegs(camera)):
            if only is None or number in only:
                image = _decoded(jpeg, size.width, size.height)
                if image is not None:
                    yield time, image

    def jpegs(self, camera: str) -> Iterator[tuple[float, bytes]]:
        """Yield the recorded images of a camera with their times of exposure, in order, as JPEG."""
        for message in messages_on(self.path, f"/camera/{camera}{_IMAGES}"):
            try:
                parts = wire.fields(message)
                time, jpeg = wire.time_of(parts, 1), wire.bytes_of(parts, 2)
            except ValueError:
                continue
            if time < 1e9 and jpeg:
                yield time, jpeg


def _decoded(jpeg: bytes, width: int, height: int) -> ImageArray | None:
    """Return an image of a camera; None if it cannot be decoded or has another size."""
    import cv2
    from PIL import Image

    try:
        with Image.open(BytesIO(jpeg), formats=("JPEG",)) as header:
            size = header.size
    except (OSError, ValueError, SyntaxError):
        return None
    if size != (width, height):
        return None
    image = cv2.imdecode(np.frombuffer(jpeg, np.uint8), cv2.IMREAD_GRAYSCALE)
    return None if image is None else np.asarray(image, dtype=np.uint8)


class _Messages:
    """The messages of a file, and the number of those that could not be read."""

    def __init__(self, contents: McapContents) -> None:
        self._messages = contents.messages
        self.skipped = 0

    def table(
        self, topic: str, schema: Mapping[str, Any], trace: type[Table], joints: int = 0
    ) -> Table:
        """Return the table of a numeric stream."""
        messages = self._messages.get(topic, ())
        kept = checked_messages(messages, schema)
        self.skipped += len(messages) - len(kept)
        columns = Columns(trace, joints)
        for message in kept:
            columns.append(row_of(message, trace, joints))
        return columns.table()

    def seen(self, at: str, info: RunInfo) -> tuple[dict[str, CameraTrace], TargetTrace | None]:
        """Return what was observed of a target, and its filter estimate; see `OtherTarget`.

        Args:
            at: the topic of a target other than the task's; empty for the task's.
            info: of the run.
        """
        cameras = {
            name: self.table(f"{at}/camera/{name}/features", streams.FEATURES_SCHEMA, CameraTrace)
            for name in info.cameras
        }
        target = self.table(at or "/target", streams.TARGET_SCHEMA, TargetTrace)
        return cameras, target if len(target.time) else None

    def events(self) -> tuple[Event, ...]:
        """Return the events, in order of time."""
        kept = []
        for message in self._messages.get("/events", ())[:_MOST_EVENTS]:
            try:
                parts = wire.fields(message)
                name, text = wire.text_of(parts, 4), wire.text_of(parts, 3)
                kept.append(Event(wire.time_of(parts, 1), echo(name), echo(text, _LONGEST_TEXT)))
            except ValueError:
                self.skipped += 1
        return tuple(sorted(kept, key=lambda event: event.time))


def _any(cameras: Mapping[str, CameraTrace], target: TargetTrace | None) -> bool:
    return target is not None or any(len(trace.time) for trace in cameras.values())


def _introduction(path: Path, contents: McapContents) -> tuple[RunInfo, str]:
    """Return the run information in the file, and the version that wrote it."""
    about = contents.metadata.get("vergence")
    if about is None:
        raise InputError(str(path), "", "a file that does not begin as one", "a run's recording")
    try:
        info = RunInfo.from_json(about["info"], about["text"])
    except (KeyError, ValueError) as error:
        given = f"an introduction that cannot be read ({type(error).__name__})"
        raise InputError(str(path), "", given, "a run's recording") from None
    return info, echo(about.get("version", ""))


def _end(end: Mapping[str, str] | None) -> tuple[Outcome | None, dict[str, Any]]:
    """Return the outcome and the summary of the run, if the file has them and they can be read."""
    try:
        if end is None:
            return None, {}
        outcome = read_outcome(end, end.get("tasks", "[]"))
        summary = _SUMMARY.validate_json(end["summary"])
    except (KeyError, ValueError):
        return None, {}
    return outcome, summary


def _cut_off(time: float) -> Outcome:
    return Outcome(OutcomeKind.CUT_OFF, "the recording ends without an outcome", time)
