"""The few numbers that say how a run went."""

from collections.abc import Callable, Mapping
from time import perf_counter

import numpy as np

from vergence.arrays import FloatArray
from vergence.runtime.pose_errors import pose_errors
from vergence.runtime.recording import RunInfo, TickRecord
from vergence.signals import ImagePoints, Outcome


class Summary:
    """Listens to a run and keeps the extremes; memory does not grow with the run.

    The real-time factor is counted from the first picture that was worked on: by then every kernel
    has been compiled.

    Args:
        camera: name of the task's camera.
    """

    def __init__(self, camera: str) -> None:
        self._camera = camera
        self._start_manipulability = float("nan")
        self._first: tuple[float, float] | None = None  # time in the run and on the wall, s
        self.values: dict[str, float] = {}

    def begin(self, info: RunInfo) -> None:
        """Nothing to prepare."""

    def tick(self, record: TickRecord) -> None:
        """Take this tick's extremes into account."""
        if record.observation is None:
            return
        self._keep_pace(record.time)
        for command in record.commands.values():
            if np.isnan(self._start_manipulability):
                self._start_manipulability = command.manipulability
            if self._start_manipulability > 0:
                ratio = command.manipulability / self._start_manipulability
                self._keep("min_manipulability_ratio", ratio, min)
            self._keep("min_penalty", command.penalty, min)
        self._keep_pose_errors(record)
        views = [view for view in record.observation.views if view.camera == self._camera]
        if views:
            self._keep_image_errors(record, views[-1])

    def _keep_image_errors(self, record: TickRecord, view: ImagePoints) -> None:
        if record.reference is not None and record.reference.points_px is not None:
            error = _farthest(view, record.reference.points_px)
            if not np.isnan(error):
                self.values["final_error_px"] = error
            self._keep("max_error_px", error, max)
        for frame in record.sample.frames:
            is_view = frame.camera == self._camera and frame.time == view.time
            if is_view and frame.truth is not None:
                self._keep("max_drift_px", _farthest(view, frame.truth.points_px), max)

    def event(self, time: float, name: str, text: str) -> None:
        """Events are for those who draw them."""

    def close(self, outcome: Outcome, summary: Mapping[str, float | str]) -> None:
        """Nothing to let go of."""

    def _keep_pose_errors(self, record: TickRecord) -> None:
        errors = pose_errors(record, self._camera)
        if errors is None:
            return
        for name, metres, radians in (
            ("target", errors.target_m, errors.target_rad),
            ("hand", errors.hand_m, errors.hand_rad),
        ):
            for key, value in (
                (f"{name}_error_m", float(np.linalg.norm(metres))),
                (f"{name}_error_deg", float(np.rad2deg(radians))),
            ):
                if not np.isnan(value):
                    self.values[f"final_{key}"] = value
                self._keep(f"max_{key}", value, max)

    def _keep_pace(self, time: float) -> None:
        now = perf_counter()
        if self._first is None:
            self._first = (time, now)
        elif now > self._first[1]:
            self.values["real_time_factor"] = (time - self._first[0]) / (now - self._first[1])

    def _keep(self, key: str, value: float, better: Callable[[float, float], float]) -> None:
        if not np.isnan(value):
            self.values[key] = better(self.values.get(key, value), value)


def _farthest(view: ImagePoints, points_px: FloatArray) -> float:
    """Return how far the farthest found point is from where it should be, px; NaN if none is."""
    distance = np.linalg.norm(view.points_px - points_px, axis=1)[view.found]
    return float(np.nanmax(distance)) if np.isfinite(distance).any() else float("nan")
