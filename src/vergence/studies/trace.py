"""A run's numbers in memory, for a study's figures."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from vergence.arrays import BoolArray, FloatArray
from vergence.runtime.recording import RunInfo, TickRecord
from vergence.signals import Frame, ImagePoints, Outcome


@dataclass(slots=True)
class Trace:
    """Listens to a run and keeps one row for every picture in which the task's camera was read."""

    camera: str
    rows: list[dict[str, float | FloatArray]] = field(default_factory=list)
    outcome: Outcome | None = None

    def begin(self, info: RunInfo) -> None:
        """Start with no rows."""
        self.rows.clear()

    def tick(self, record: TickRecord) -> None:
        """Keep what this tick saw, knew and commanded."""
        if record.observation is None:
            return
        view = record.observation.views[-1]
        frame = next((f for f in record.sample.frames if _is_of(f, view)), None)
        if frame is None or frame.truth is None:
            return
        truth = frame.truth
        desired = None if record.reference is None else record.reference.points_px
        command = next(iter(record.commands.values()), None)
        nothing = float("nan")
        error = nothing if desired is None else _largest(view.points_px - desired, view.found)
        self.rows.append(
            {
                "time": frame.time,
                "error_px": error,
                "drift_px": _largest(view.points_px - truth.points_px, view.found & truth.visible),
                "T_world_camera": truth.T_world_camera,
                "T_world_target": truth.T_world_target,
                "depth_m": float(truth.depth_m[0]),
                "manipulability": nothing if command is None else command.manipulability,
                "penalty": nothing if command is None else command.penalty,
            }
        )

    def event(self, time: float, name: str, text: str) -> None:
        """Events are in the outcome's reason."""

    def close(self, outcome: Outcome, summary: Mapping[str, float | str]) -> None:
        """Keep how it ended."""
        self.outcome = outcome

    def __getitem__(self, column: str) -> FloatArray:
        """Return a column as an array, one row a picture."""
        return np.array([row[column] for row in self.rows])


def _is_of(frame: Frame, view: ImagePoints) -> bool:
    return frame.camera == view.camera and frame.time == view.time


def _largest(difference: FloatArray, which: BoolArray) -> float:
    sizes = np.linalg.norm(difference[which], axis=1)
    return float(sizes.max()) if len(sizes) else float("nan")
