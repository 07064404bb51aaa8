"""Reads a run back from its folder."""

import json
from collections.abc import Container, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Self

import numpy as np

from vergence.arrays import FloatArray, ImageArray
from vergence.errors import InputError
from vergence.places import find_recording
from vergence.runtime.recording import wire
from vergence.runtime.recording.mcap_contents import McapContents, messages_on
from vergence.runtime.recording.run_info import RunInfo
from vergence.runtime.recording.traces import (
    ArmTrace,
    CameraTrace,
    Row,
    TargetTrace,
    arm_trace,
    camera_trace,
    target_trace,
)
from vergence.signals import Outcome, OutcomeKind

_PICTURES = "/image"  # how the topics end that are read one by one


@dataclass(frozen=True, slots=True)
class Event:
    """Something that happened once."""

    time: float  # s since the start of the run
    name: str
    text: str


@dataclass(frozen=True, slots=True)
class Recording:
    """A run as its folder tells it; open one with `Recording.open`."""

    path: Path  # of the file
    info: RunInfo
    version: str  # of the vergence that wrote it
    arms: Mapping[str, ArmTrace]
    cameras: Mapping[str, CameraTrace]
    target: TargetTrace | None  # where a filter ran
    events: tuple[Event, ...]  # in order of time
    outcome: Outcome | None  # None if the run was cut off before it could say
    summary: Mapping[str, float | str | None]
    complete: bool  # whether the file ends as it should

    @classmethod
    def open(cls, run: str | Path) -> Self:
        """Read a recording, up to the cut if it was cut off.

        Args:
            run: the run folder, or the recording alone.

        Raises:
            InputError: if there is no recording, or it is not one of ours.
        """
        path = find_recording(run)
        contents = McapContents.read(path, leave_out=_PICTURES)
        info, version = _introduction(path, contents)
        target = _rows(contents, "/target")
        end = contents.metadata.get("outcome")
        return cls(
            path=path,
            info=info,
            version=version,
            arms={
                name: arm_trace(_rows(contents, f"/arm/{name}/state"), len(arm.names))
                for name, arm in info.arms.items()
            },
            cameras={
                name: camera_trace(_rows(contents, f"/camera/{name}/features"))
                for name in info.cameras
            },
            target=target_trace(target) if target else None,
            events=tuple(_event(message) for message in contents.messages.get("/events", ())),
            outcome=_outcome(end) if end else None,
            summary=json.loads(end["summary"]) if end else {},
            complete=contents.complete and end is not None,
        )

    @property
    def folder(self) -> Path:
        """The run folder."""
        return self.path.parent

    @property
    def duration(self) -> float:
        """Time of the last tick, s."""
        arms = (trace.time for trace in self.arms.values())
        cameras = (trace.received for trace in self.cameras.values())
        return max((float(time[-1]) for time in (*arms, *cameras) if len(time)), default=0.0)

    def image_times(self, camera: str) -> FloatArray:
        """Return when the kept pictures of a camera were exposed, (P,) s."""
        return np.array([wire.time_of(parts, 1) for parts in self._pictures(camera)])

    def images(
        self, camera: str, only: Container[int] | None = None
    ) -> Iterator[tuple[float, ImageArray]]:
        """Yield the kept pictures of a camera with their time of exposure, in order.

        Args:
            camera: its name.
            only: which of them, counted from 0; all if None. The others are not decoded.
        """
        import cv2

        for number, (time, jpeg) in enumerate(self.jpegs(camera)):
            if only is None or number in only:
                image = cv2.imdecode(np.frombuffer(jpeg, np.uint8), cv2.IMREAD_GRAYSCALE)
                yield time, np.asarray(image, dtype=np.uint8)

    def jpegs(self, camera: str) -> Iterator[tuple[float, bytes]]:
        """Yield the kept pictures of a camera with their time of exposure, in order, as JPEG."""
        for parts in self._pictures(camera):
            yield wire.time_of(parts, 1), wire.bytes_of(parts, 2)

    def _pictures(self, camera: str) -> Iterator[wire.Fields]:
        topic = f"/camera/{camera}{_PICTURES}"
        return map(wire.fields, messages_on(self.path, topic))


def _introduction(path: Path, contents: McapContents) -> tuple[RunInfo, str]:
    """Return what the file says about the run, and the version that wrote it."""
    about = contents.metadata.get("vergence")
    if about is None:
        raise InputError(str(path), "", "a file that does not begin as one", "a run's recording")
    return RunInfo.from_json(json.loads(about["info"]), about["text"]), about["version"]


def _rows(contents: McapContents, topic: str) -> list[Row]:
    return [json.loads(message) for message in contents.messages.get(topic, ())]


def _event(message: bytes) -> Event:
    parts = wire.fields(message)
    return Event(wire.time_of(parts, 1), wire.text_of(parts, 4), wire.text_of(parts, 3))


def _outcome(end: Mapping[str, str]) -> Outcome:
    return Outcome(OutcomeKind(end["kind"]), end["reason"], float(end["time"]))
