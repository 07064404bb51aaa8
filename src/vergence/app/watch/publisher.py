"""Puts every tick of a running cell on the view_state."""

from collections.abc import Mapping

import numpy as np

from vergence.app.figures.arm import drawn_positions
from vergence.app.watch.camera_view import CameraView, OtherMarks
from vergence.app.watch.limits_now import LimitsNow
from vergence.app.watch.outline import outline, target_corners
from vergence.app.watch.plots import Plot, drawn_errors, error_key, live_plots, other_key, row
from vergence.app.watch.view_state import ViewState
from vergence.arrays import FloatArray
from vergence.cell import Cell
from vergence.geometry import angle_between, se3_inverse, transform_points
from vergence.robot import manipulability_measure
from vergence.runtime import RunInfo, TickRecord
from vergence.runtime.results import about_other, other_names, tick_pose_errors
from vergence.signals import Frame, FrameTruth, ImagePoints, Observation, Outcome, Reference
from vergence.simulation import SimulatedDriver

_MM = 1e3


class Publisher:
    """A listener that hands each tick to the page.

    Args:
        view_state: what the page shows.
        cell: what runs.
        driver: of that cell.
        about: what else the page has to know of the run; `truth`, whether its frames have any.
    """

    def __init__(
        self,
        view_state: ViewState,
        cell: Cell,
        driver: SimulatedDriver,
        about: Mapping[str, object],
    ) -> None:
        self._view_state, self._cell, self._driver = view_state, cell, driver
        self._about, self._truth = about, bool(about["truth"])
        self._corners = target_corners(driver.world)
        self._plots: tuple[Plot, ...] = ()
        self._info: RunInfo | None = None
        self._limits = LimitsNow()

    def begin(self, info: RunInfo) -> None:
        """Tell the page what is about to run."""
        self._info = info
        arm = info.arms[self._cell.task.arm]
        self._plots = live_plots(self._cell, len(self._driver.features), arm, self._truth)
        self._view_state.begin(
            {
                "cell": info.cell,
                "task": self._cell.task.kind,
                "cameras": [
                    {"name": name, "width": camera.width, "height": camera.height}
                    for name, camera in info.cameras.items()
                    if name in self._cell.watched
                ],
                "task_camera": info.task_camera,
                "plots": [plot.as_json() for plot in self._plots],
                **self._about,
            }
        )
        self._view_state.status(outcome=None, limits=[])

    def tick(self, record: TickRecord) -> None:
        """Hand on what came in, what was seen and what was asked."""
        views = [self._camera_view(frame, record) for frame in record.sample.frames]
        self._view_state.tick(row(record.time, self._plots, self._values(record)), views)
        if (command := record.commands.get(self._cell.task.arm)) is not None:
            shaped = self._limits.at(record.time, command.active, command.slack)
            self._view_state.status(limits=shaped)

    def event(self, time: float, name: str, text: str) -> None:
        """Hand on an event."""
        self._view_state.event(time, name, text)

    def close(self, outcome: Outcome, summary: Mapping[str, float | str]) -> None:
        """Tell the page how it ended."""
        end = {"kind": outcome.kind.value, "reason": outcome.reason, "time": outcome.time}
        self._view_state.status(outcome={**end, "succeeded": outcome.succeeded})

    def _camera_view(self, frame: Frame, record: TickRecord) -> CameraView:
        view, truth = _view(record.observation, frame), frame.truth
        camera = self._driver.cameras[frame.camera]
        around = None
        if truth is not None and not self._looks_at_tool(frame.camera):
            T_camera_target = se3_inverse(truth.T_world_camera) @ truth.T_world_target
            around = outline(self._corners, T_camera_target, camera)
        return CameraView(
            frame.camera,
            frame.time,
            frame.image,
            view,
            self._desired(frame, record.reference, view),
            _true(truth, view),
            truth.T_world_camera if truth else None,
            truth.T_world_target if truth else None,
            around,
            others=tuple(_other_marks(about_other(record, n), frame) for n in other_names(record)),
        )

    def _desired(
        self, frame: Frame, reference: Reference | None, view: ImagePoints | None
    ) -> FloatArray | None:
        """Return where the points of an image should be, if the reference speaks of them.

        Of a desired pose, where it would show the points that were searched for.
        """
        if reference is None or frame.camera != self._cell.task.camera:
            return reference.elsewhere_px.get(frame.camera) if reference else None
        if reference.points_px is not None or reference.T_camera_target is None:
            return reference.points_px
        points = transform_points(reference.T_camera_target, self._driver.features)
        places = self._driver.cameras[frame.camera].project(points)
        return places if view is None else np.where(view.asked[:, None], places, np.nan)

    def _values(self, record: TickRecord) -> dict[str, FloatArray]:
        assert self._info is not None, "a run begins before it ticks"
        name = self._cell.task.arm
        q = record.sample.joints[name].position
        return {
            "joints": drawn_positions(self._info.arms[name], q),
            "manipulability": np.array(
                [manipulability_measure(self._driver.arms[name].jacobian(q))]
            ),
            **self._errors(record),
            **self._other_errors(record),
        }

    def _other_errors(self, record: TickRecord) -> dict[str, FloatArray]:
        """Return how far the other targets are from where they are believed to be."""
        assert self._info is not None, "a run begins before it ticks"
        drawn = {}
        for name in other_names(record):
            errors = tick_pose_errors(about_other(record, name), self._info)
            if len(errors.time):
                drawn[other_key(name)] = _MM * np.linalg.norm(errors.target_m, axis=1)
        return drawn

    def _errors(self, record: TickRecord) -> dict[str, FloatArray]:
        if record.observation is None or record.reference is None:
            return {}
        if record.reference.T_camera_target is not None:
            return self._pose_errors(record)
        task = self._cell.task.camera
        plots = {plot.key: plot for plot in self._plots}
        drawn: dict[str, FloatArray] = {}
        for view in record.observation.views:
            mine = view.camera == task
            elsewhere = record.reference.elsewhere_px.get(view.camera)
            desired = record.reference.points_px if mine else elsewhere
            plot = plots.get(error_key("" if mine else view.camera))
            if plot is not None and desired is not None and desired.shape == view.points_px.shape:
                distance = np.linalg.norm(view.points_px - desired, axis=1)
                drawn[plot.key] = drawn_errors(np.where(view.found, distance, np.nan), plot)
        return drawn

    def _pose_errors(self, record: TickRecord) -> dict[str, FloatArray]:
        assert self._info is not None, "a run begins before it ticks"
        if not self._truth:
            return self._estimated_errors(record)
        errors = tick_pose_errors(record, self._info)
        if not len(errors.time):
            return {}
        return {
            "pose_mm": _MM * np.linalg.norm(errors.camera_m, axis=1),
            "pose_deg": np.rad2deg(errors.camera_rad),
            "target_mm": _MM * np.linalg.norm(errors.target_m, axis=1),
        }

    def _estimated_errors(self, record: TickRecord) -> dict[str, FloatArray]:
        """Return how far the camera is from its desired pose to where the target seems to be."""
        assert record.observation is not None
        assert record.reference is not None
        target, desired = record.observation.target, record.reference.T_camera_target
        task, carries = self._cell.task, self._cell.cameras[self._cell.task.camera].arm
        mine = (frame for frame in record.sample.frames if frame.camera == task.camera)
        frame = next(mine, None)
        if target is None or desired is None or frame is None or carries != task.arm:
            return {}
        T_world_camera = self._driver.arms[task.arm].forward_kinematics(frame.joints[task.arm])
        T_camera_target = se3_inverse(T_world_camera) @ target.T_world_target
        away_m = T_camera_target[:3, 3] - desired[:3, 3]
        return {
            "pose_mm": np.array([_MM * np.linalg.norm(away_m)]),
            "pose_deg": np.array([np.rad2deg(angle_between(T_camera_target, desired))]),
        }

    def _looks_at_tool(self, camera: str) -> bool:
        return self._cell.tool is not None and self._cell.tool.camera == camera


def _view(observation: Observation | None, frame: Frame) -> ImagePoints | None:
    """Return what was measured in an image."""
    views = observation.views if observation else ()
    mine = (view for view in views if (view.camera, view.time) == (frame.camera, frame.time))
    return next(mine, None)


def _other_marks(record: TickRecord, frame: Frame) -> OtherMarks:
    """Return what to draw in an image of another target, which a tick is about."""
    same = (f for f in record.sample.frames if (f.camera, f.time) == (frame.camera, frame.time))
    truth, view = next(same).truth, _view(record.observation, frame)
    return OtherMarks(view, _true(truth, view))


def _true(truth: FrameTruth | None, view: ImagePoints | None) -> FloatArray | None:
    """Return where the points truly are, those in sight."""
    if truth is None or view is None:
        return None
    return np.where(truth.visible[:, None], truth.points_px, np.nan)
