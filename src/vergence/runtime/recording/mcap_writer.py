"""The contents of a recording and their topics."""

import json
from collections.abc import Mapping
from importlib.metadata import version
from pathlib import Path

import numpy as np

from vergence.camera.image_file import as_jpeg
from vergence.places import CELL, RECORDING
from vergence.runtime.json_numbers import finite
from vergence.runtime.recording import messages, streams
from vergence.runtime.recording.mcap_file import McapFile
from vergence.runtime.recording.outcome_json import outcome_json
from vergence.runtime.results import (
    about_other,
    arm_row,
    camera_row,
    images_of,
    other_names,
    target_row,
)
from vergence.runtime.run_info import RunInfo
from vergence.runtime.tick import TickRecord
from vergence.signals import Frame, ImagePoints, Outcome

SUMMARY = "summary.json"

_FLUSH_PERIOD = 1.0  # s of the run that are lost if the process is killed


class McapWriter:
    """The open recording of one run.

    Numbers go to JSON streams (`streams`), images, annotations, joints, poses and events to
    Foxglove's types (`messages`). The file is flushed once per second of the run, so that it can be
    read up to there whatever happens to the process.
    """

    def __init__(self, folder: Path, info: RunInfo, image_every: int, jpeg_quality: int) -> None:
        self._folder = folder
        self._info = info
        self._image_every = image_every
        self._jpeg_quality = jpeg_quality
        self._images = dict.fromkeys(info.cameras, 0)
        self._flushed = 0.0
        self.now = 0.0  # s, of the last record
        folder.mkdir(parents=True, exist_ok=True)
        (folder / SUMMARY).unlink(missing_ok=True)  # of an earlier run
        (folder / CELL).write_text(info.text, encoding="utf-8")
        self._file = McapFile(folder / RECORDING)
        self._introduce()
        _warm_up()

    def tick(self, record: TickRecord) -> None:
        """Record one turn of the loop."""
        self.now = record.time
        for arm in record.sample.joints:
            self._record_arm(record, arm)
        for frame in record.sample.frames:
            self._record_image(frame)
        self._record_seen(record, "target", "")
        for name in other_names(record):
            self._record_seen(about_other(record, name), f"target {name}", f"/target/{name}")
        if record.time - self._flushed >= _FLUSH_PERIOD:
            self._file.flush()
            self._flushed = record.time

    def event(self, time: float, name: str, text: str) -> None:
        """Record a single event."""
        self.now = max(self.now, time)
        self._file.typed("/events", self.now, messages.log(time, name, text))

    def close(self, outcome: Outcome, summary: Mapping[str, float | str]) -> None:
        """Record the end and close the file; the summary repeats it in case the file is cut off."""
        end, values = outcome_json(outcome), finite(summary)
        result = {"cell": self._info.cell, "outcome": end, "summary": values}
        text = json.dumps(result, indent=2) + "\n"
        try:
            words = {"kind": end["kind"], "reason": end["reason"], "time": repr(outcome.time)}
            tasks = {"tasks": json.dumps(end["tasks"])} if outcome.tasks else {}
            self._file.metadata("outcome", {**words, **tasks, "summary": json.dumps(values)})
            self._file.close()
        finally:
            (self._folder / SUMMARY).write_text(text, encoding="utf-8")

    def _introduce(self) -> None:
        info = json.dumps(self._info.as_json())
        words = {"version": version("vergence"), "info": info, "text": self._info.text}
        self._file.metadata("vergence", words)
        for name, camera in self._info.cameras.items():
            topic = f"/camera/{name}/calibration"
            self._file.typed(topic, 0.0, messages.calibration(name, camera))
        self._file.flush()

    def _record_arm(self, record: TickRecord, arm: str) -> None:
        row = streams.message_of(arm_row(record, arm))
        self._file.numbers(f"/arm/{arm}/state", self.now, streams.ARM_SCHEMA, row)
        state, names = record.sample.joints[arm], self._info.arms[arm].names
        joints = messages.joints(state.time, names, state.position, state.velocity)
        self._file.typed(f"/arm/{arm}/joints", self.now, joints)

    def _record_seen(self, record: TickRecord, name: str, at: str) -> None:
        """Record what was observed of a target, under its own topic if it is not the task's."""
        for frame, view in images_of(record):
            self._record_points(record, frame, view, name, at)
        target = record.observation.target if record.observation else None
        if target is None:
            return
        row = streams.message_of(target_row(record, target))
        self._file.numbers(at or "/target", self.now, streams.TARGET_SCHEMA, row)
        poses = {f"{name} estimate": target.T_world_target}
        self._file.typed("/tf", self.now, messages.transforms(target.time, poses))

    def _record_points(
        self, record: TickRecord, frame: Frame | None, view: ImagePoints | None, name: str, at: str
    ) -> None:
        row = camera_row(record, self._info, frame, view)
        camera, time = row["camera"], row["time"]
        message = streams.message_of(row)
        topic = f"{at}/camera/{camera}"
        self._file.numbers(f"{topic}/features", self.now, streams.FEATURES_SCHEMA, message)
        marks = messages.annotations(time, view, row.get("desired_px"), row.get("true_px"))
        self._file.typed(f"{topic}/annotations", self.now, marks)
        if "T_world_camera" in row:
            poses = {camera: row["T_world_camera"]}
            if camera == self._info.task_camera:  # other cameras may observe a tool
                poses[name] = row["T_world_target"]
            self._file.typed("/tf", self.now, messages.transforms(time, poses))

    def _record_image(self, frame: Frame) -> None:
        count = self._images.get(frame.camera, 0)
        self._images[frame.camera] = count + 1
        if frame.image is None or not self._image_every or count % self._image_every:
            return
        image = messages.image(frame.camera, frame.time, as_jpeg(frame.image, self._jpeg_quality))
        self._file.typed(f"/camera/{frame.camera}/image", self.now, image)


def _warm_up() -> None:
    """Load and compile everything that would otherwise delay the first tick."""
    messages.transforms(0.0, {"": np.eye(4)})
    as_jpeg(np.zeros((8, 8), dtype=np.uint8), 50)
