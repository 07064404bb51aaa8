"""The few numbers that say how a run went."""

from collections.abc import Mapping

import numpy as np

from vergence.outcome import Outcome
from vergence.runtime.recording import RunInfo, TickRecord


class Summary:
    """Listens to a run and keeps the extremes; memory does not grow with the run.

    Args:
        camera: name of the task's camera.
    """

    def __init__(self, camera: str) -> None:
        self._camera = camera
        self.values: dict[str, float] = {}
        self._start_manipulability = float("nan")

    def begin(self, info: RunInfo) -> None:
        """Nothing to prepare."""

    def tick(self, record: TickRecord) -> None:
        """Take this tick's extremes into account."""
        values = self.values
        for command in record.commands.values():
            if np.isnan(self._start_manipulability):
                self._start_manipulability = command.manipulability
            ratio = command.manipulability / self._start_manipulability
            _keep(values, "min_manipulability_ratio", ratio, min)
            _keep(values, "min_penalty", command.penalty, min)
        if record.observation is None or record.reference is None:
            return
        view = record.observation.views[-1]
        desired = record.reference.points_px
        if desired is not None and view.found.any():
            error = _distance(view.points_px[view.found], desired[view.found])
            values["final_error_px"] = error
            _keep(values, "max_error_px", error, max)
        for frame in record.sample.frames:
            if frame.truth is None or frame.camera != self._camera or frame.time != view.time:
                continue
            known = view.found & frame.truth.visible
            if known.any():
                drift = _distance(view.points_px[known], frame.truth.points_px[known])
                _keep(values, "max_drift_px", drift, max)

    def event(self, time: float, name: str, text: str) -> None:
        """Events are for those who draw them."""

    def close(self, outcome: Outcome, summary: Mapping[str, float | str]) -> None:
        """Nothing to let go of."""


def _distance(a: "np.ndarray[tuple[int, int], np.dtype[np.float64]]", b: object) -> float:
    return float(np.max(np.linalg.norm(a - np.asarray(b), axis=1)))


def _keep(values: dict[str, float], key: str, value: float, better: object) -> None:
    assert callable(better)
    if not np.isnan(value):
        values[key] = better(values[key], value) if key in values else value
