"""What a recording has to show at any of its instants."""

from collections.abc import Iterator

import numpy as np

from vergence.app.figures.arm import drawn_positions
from vergence.app.recorded_poses import RecordedPoses, newest
from vergence.app.recorded_world import RecordedWorld
from vergence.app.watch.camera_view import CameraView, OtherMarks
from vergence.app.watch.limits_now import LimitsNow
from vergence.app.watch.plots import (
    MANIPULABILITY,
    MEASURE,
    POSE_DEG,
    POSE_MM,
    TARGET_MM,
    Plot,
    drawn_errors,
    error_key,
    error_plot,
    joints_plot,
    other_key,
    other_plot,
    row,
)
from vergence.app.watch.view_state import Row
from vergence.arrays import FloatArray
from vergence.geometry import angle_between, se3_inverse
from vergence.robot import manipulability_measure
from vergence.runtime.recording import Recording
from vergence.runtime.results import CameraTrace
from vergence.signals import ImagePoints, SearchWindows

_MM = 1e3


class Playback:
    """Holds a recording with its images, still as JPEG.

    Args:
        recording: of the run.
        world: the cell it was recorded in, if it is known.

    Attributes:
        cameras: those that took images.
        plots: the panels that the recording fills.
        knows_truth: whether it says where the points truly were; that of a robot cannot.
    """

    def __init__(self, recording: Recording, world: RecordedWorld | None) -> None:
        self._recording, self._world = recording, world
        self._arm = _moved_arm(recording)
        traces = recording.cameras
        self.cameras = tuple(name for name in traces if len(traces[name].time))
        self._jpegs = {name: tuple(recording.jpegs(name)) for name in self.cameras}
        self._views: dict[str, CameraView] = {}
        self.knows_truth = any(np.isfinite(traces[n].true_px).any() for n in self.cameras)
        self._poses = RecordedPoses(recording)
        self.plots = tuple(self._choose_plots())

    def rows(self) -> list[Row]:
        """Return all values of all panels, in order of time."""
        found = [
            *self._arm_rows(),
            *self._error_rows(),
            *self._pose_rows(),
            *self._target_rows(),
            *self._other_rows(),
        ]
        return sorted(found, key=lambda entry: entry[0])

    def times(self) -> FloatArray:
        """Return when images came, in order, s."""
        traces = (self._recording.cameras[name].received for name in self.cameras)
        return np.unique(np.concatenate([np.zeros(1), *traces]))

    def views(self, time: float) -> list[CameraView]:
        """Return the images that had come by a time, the same objects while they are the same."""
        for name in self.cameras:
            shown = self._views.get(name)
            fresh = self._camera_view(name, time)
            if shown is None or shown.time != fresh.time:
                self._views[name] = fresh
        return list(self._views.values())

    def state(self, time: float) -> FloatArray | None:
        """Return MuJoCo's state of the world at a time; None where the world is not known."""
        if self._world is None:
            return None
        return self._world.place(self._poses.joints(time), self._poses.targets(time))

    def limits(self, time: float) -> list[dict[str, object]]:
        """Return the limits that shaped the motion at a time, as `LimitsNow` does."""
        if not self._arm or not len((trace := self._recording.arms[self._arm]).time):
            return []
        row = newest(trace.time, time)
        return LimitsNow().at(time, trace.active[row], trace.slack[row])

    def _choose_plots(self) -> Iterator[Plot]:
        for name, trace in self._recording.cameras.items():
            if np.isfinite(trace.error_px).any():
                yield error_plot(trace.error_px.shape[1], self._further(name))
            if np.isfinite(trace.T_camera_target_desired).any():
                yield from (POSE_MM, POSE_DEG)
        if self._recording.target is not None and len(self._poses.true_times):
            yield TARGET_MM
        for name, other in self._recording.others.items():
            if len(other.pose_errors.time):
                yield other_plot(name)
        if not self._arm:
            return
        yield joints_plot(self._recording.info.arms[self._arm])
        if self._world is not None:
            yield MANIPULABILITY
        elif np.isfinite(self._recording.arms[self._arm].manipulability).any():
            yield MEASURE

    def _arm_rows(self) -> Iterator[Row]:
        if not self._arm:
            return
        info, trace = self._recording.info.arms[self._arm], self._recording.arms[self._arm]
        measures = trace.manipulability
        if self._world is not None:
            arm = self._world.world.arms[self._arm]
            measures = np.array([manipulability_measure(arm.jacobian(q)) for q in trace.position])
        shares = drawn_positions(info, trace.position)
        for time, share, measure in zip(trace.time.tolist(), shares, measures, strict=True):
            values = {"joints": share, "manipulability": np.array([measure])}
            yield row(time, self.plots, values)

    def _error_rows(self) -> Iterator[Row]:
        for name, trace in self._recording.cameras.items():
            key = error_key(self._further(name))
            plots = [plot for plot in self.plots if plot.key == key]
            for time, error in zip(trace.received.tolist(), trace.error_px, strict=True):
                values = {plot.key: drawn_errors(error, plot) for plot in plots}
                yield row(time, self.plots, values)

    def _pose_rows(self) -> Iterator[Row]:
        for trace in self._recording.cameras.values():
            for index in np.flatnonzero(np.isfinite(trace.T_camera_target_desired[:, 0, 0])):
                desired = trace.T_camera_target_desired[index]
                T = se3_inverse(trace.T_world_camera[index]) @ trace.T_world_target[index]
                values = {
                    "pose_mm": np.array([_MM * np.linalg.norm(T[:3, 3] - desired[:3, 3])]),
                    "pose_deg": np.array([np.rad2deg(angle_between(T, desired))]),
                }
                yield row(float(trace.received[index]), self.plots, values)

    def _further(self, camera: str) -> str:
        """Return the name of a camera that is not the task's own; empty for that."""
        return "" if camera == self._recording.info.task_camera else camera

    def _target_rows(self) -> Iterator[Row]:
        target, times = self._recording.target, self._poses.true_times
        if target is None or not len(times):
            return
        for time, T in zip(target.time.tolist(), target.T_world_target, strict=True):
            away = T[:3, 3] - self._poses.true_poses[newest(times, time)][:3, 3]
            yield row(time, self.plots, {"target_mm": np.array([_MM * np.linalg.norm(away)])})

    def _other_rows(self) -> Iterator[Row]:
        for name, other in self._recording.others.items():
            errors = other.pose_errors
            for time, away in zip(errors.time.tolist(), errors.target_m, strict=True):
                values = {other_key(name): np.array([_MM * np.linalg.norm(away)])}
                yield row(time, self.plots, values)

    def _camera_view(self, name: str, time: float) -> CameraView:
        trace, jpegs = self._recording.cameras[name], self._jpegs[name]
        index, kept = newest(trace.received, time), b""
        if jpegs:
            number = newest(np.array([taken for taken, _ in jpegs]), float(trace.time[index]))
            taken, kept = jpegs[number]
            index = int(np.argmin(np.abs(trace.time - taken)))
        return CameraView(
            name,
            float(trace.time[index]),
            None,
            _points(name, trace, index),
            trace.desired_px[index],
            trace.true_px[index],
            kept=kept,
            others=tuple(self._other_marks(name, float(trace.time[index]))),
        )

    def _other_marks(self, camera: str, time: float) -> Iterator[OtherMarks]:
        """Yield what is to be drawn of the other targets in an image."""
        for other in self._recording.others.values():
            trace = other.cameras[camera]
            for index in np.flatnonzero(trace.time == time):
                yield OtherMarks(_points(camera, trace, int(index)), trace.true_px[index])


def _moved_arm(recording: Recording) -> str:
    """Return the arm that was commanded; the first if none was, empty without an arm."""
    commanded = (n for n, trace in recording.arms.items() if np.isfinite(trace.command).any())
    return next(commanded, next(iter(recording.arms), ""))


def _points(name: str, trace: CameraTrace, index: int) -> ImagePoints | None:
    if not np.isfinite(trace.points_px[index]).any():
        return None
    count, reasons = len(trace.found[index]), trace.reasons[index]
    windows = SearchWindows(trace.window_center_px[index], trace.window_half_px[index])
    without = trace.asked[index].all() and not np.isfinite(windows.half_px).any()
    return ImagePoints(
        name,
        float(trace.time[index]),
        trace.points_px[index],
        trace.covariance_px[index],
        trace.found[index],
        (*reasons, *[""] * (count - len(reasons))),
        None if without else windows,
        trace.joined[index] if trace.joined[index].any() else None,
    )
