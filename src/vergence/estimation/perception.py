"""Predict-select-measure-update tracking loop."""

from collections.abc import Callable, Sequence
from operator import attrgetter
from typing import Generic

import numpy as np
from numba import njit

from vergence.arrays import BoolArray, FloatArray, ImageArray, IntArray
from vergence.camera.lens import HEIGHT, WIDTH
from vergence.errors import InputError
from vergence.estimation.filters.history import FilterHistory
from vergence.estimation.filters.target_filter import B, TargetFilter, Verdict, state_of
from vergence.estimation.measure import (
    CameraPose,
    Find,
    Measure,
    every_point,
    measured_in,
    nothing_found,
    usable_views,
)
from vergence.estimation.perception_settings import PerceptionSettings
from vergence.estimation.recovery import NoPose, pose_from_points
from vergence.estimation.rig import CameraRig, normalized_noise
from vergence.estimation.selection import Candidates, InformationSelection, Selection
from vergence.estimation.spacing import keep_apart
from vergence.estimation.target_shape import TargetShape
from vergence.estimation.tracking_step import Expected, Predicted
from vergence.estimation.view import View, view_of
from vergence.estimation.visibility import (
    Blocked,
    Visibility,
    add_obstacles,
    predict_visibility,
)
from vergence.estimation.windows import WindowRule, Windows, open_windows
from vergence.geometry import se3_compose, se3_inverse, transform_points
from vergence.signals import Frame, Observation, TargetState

DOUBT = 0.4  # fraction of recent points that disagreed, above which more of them are measured
JUDGED = (Verdict.USED, Verdict.RECOVERED, Verdict.CONTRADICTED)


class PosePerception(Generic[B]):
    """Tracks one target with any number of cameras; a stage of the loop.

    For every image that arrives, the target's pose is predicted to its exposure, the features that
    the camera will see are determined, the few worth measuring are selected over all cameras
    together, and only small windows around them are searched. The points found there update the
    pose, those of one exposure together. [Lippiello2005] section IV, Fig. 3.

    A lost target is searched for around its last pose, with the largest windows, and in whole
    images if `find` is given. While it is lost, no pose is reported and no point counts as found.
    """

    def __init__(
        self,
        rig: CameraRig,
        shape: TargetShape,
        camera_pose: CameraPose,
        measure: Measure,
        target_filter: TargetFilter[B],
        start: B,
        *,
        selection: Selection | None = None,
        windows: WindowRule | None = None,
        settings: PerceptionSettings | None = None,
        blocked_at: Callable[[Frame], Blocked] | None = None,
        find: Find | None = None,
    ) -> None:
        """Prepare to track a target.

        Args:
            rig: the cameras.
            shape: the target.
            camera_pose: computes the pose of a camera from the joints at the exposure.
            measure: finds features inside windows.
            target_filter: `PoseFilter`, or `RpyPoseFilter` for the paper's.
            start: initial belief of that filter.
            selection: how features are selected; by information by default.
            windows: sizes of the windows.
            settings: budget and limits on missed images.
            blocked_at: returns, for an exposure, a function that returns what occludes points of
                the target for a camera; the target itself must not count.
            find: finds the target in a whole image when it is lost.
        """
        self._rig, self._shape, self._camera_pose = rig, shape, camera_pose
        self._measure, self._blocked_at, self._find = measure, blocked_at, find
        self._selection = selection or InformationSelection()
        self._windows = windows or WindowRule()
        self._settings = settings or PerceptionSettings()
        self._noise = normalized_noise(rig)
        self._diagonal = np.hypot(rig.lenses[:, WIDTH], rig.lenses[:, HEIGHT])
        self._filter = target_filter
        self._history = FilterHistory(target_filter, start, self._settings.horizon)
        self._timeout_from = start.time
        self._last_seen = start
        self._held = np.zeros((len(rig.cameras), len(shape.points)), dtype=np.bool_)
        self._lost = ""

    @property
    def belief(self) -> B:
        """The belief after the newest image."""
        return self._history.belief

    @property
    def lost(self) -> str:
        """Why the target counts as lost; empty while it is tracked."""
        return self._lost

    @property
    def state(self) -> TargetState:
        """The belief after the newest image, in the form that perception delivers."""
        return state_of(self.belief)

    def pose_at(self, frame: Frame) -> FloatArray:
        """Return the expected T_world_target (4, 4) at an exposure; the last one if lost."""
        return self._expected(frame.time).T_world_target

    def observe(self, frames: Sequence[Frame]) -> Observation | None:
        """Return the observation in the images and the target's pose, or None without an image.

        Images of cameras that are not in the rig are ignored.

        Raises:
            InputError: if an image does not have the size of its camera's model.
        """
        known = [frame for frame in frames if frame.camera in self._rig.numbers]
        if not known:
            return None
        predicted = self._predict(sorted(known, key=attrgetter("time", "camera")))
        visibility = self._see(predicted)
        chosen = self._choose(predicted, visibility)
        windows = self._open(predicted, chosen, visibility)
        measured = measured_in(windows, predicted, self._measure)
        views = usable_views(windows, predicted, measured, self._rig.lenses)
        agreeing = self._correct(views)
        time = predicted.frames[-1].time
        self._judge(time, views, predicted.frames)
        points = every_point(
            predicted.frames, visibility, windows, measured, agreeing, self._windows.most_px
        )
        if self._lost:
            return Observation(time, tuple(nothing_found(p, self._lost) for p in points))
        return Observation(time, points, state_of(self.belief))

    def _expected(self, time: float) -> Expected:
        belief = self._last_seen if self._lost else self._history.at(time)
        doubt = belief.disagreeing
        certain = belief.consistency.holds and doubt < DOUBT
        return Expected(belief.T_world_target, belief.honest_covariance, doubt, certain)

    def _predict(self, frames: list[Frame]) -> Predicted:
        """Return the predictions for images in order of exposure."""
        for frame in frames:
            if frame.image is not None:
                require_size(frame, frame.image, self._rig)
        times = sorted({frame.time for frame in frames})
        expected = tuple(map(self._expected, times))
        exposures = np.array([times.index(frame.time) for frame in frames])
        T_world_camera = np.array([self._camera_pose(f.camera, f.joints) for f in frames])
        T_world_target = np.array([e.T_world_target for e in expected])[exposures]
        T_camera_world, T_camera_target = seen_from(T_world_camera, T_world_target)
        return Predicted(
            tuple(frames),
            np.array([self._rig.numbers[frame.camera] for frame in frames]),
            T_world_camera,
            T_camera_world,
            T_world_target,
            T_camera_target,
            expected,
            exposures,
        )

    def _see(self, predicted: Predicted) -> Visibility:
        visibility = predict_visibility(
            self._shape,
            predicted.T_camera_target,
            self._rig.lenses[predicted.numbers],
            margin_px=self._settings.margin_px,
            least_cosine=self._settings.least_cosine,
        )
        if self._blocked_at is not None:
            for n, frame in enumerate(predicted.frames):
                blocked = self._blocked_at(frame)
                world = transform_points(predicted.T_world_target[n], self._shape.points)
                eye = predicted.T_world_camera[n, :3, 3]
                add_obstacles(visibility.status[n], blocked, eye, world)
        return visibility

    def _choose(self, predicted: Predicted, visibility: Visibility) -> BoolArray:
        visible, numbers, newest = visibility.visible, predicted.numbers, predicted.newest
        if self._lost:
            return visible
        held = self._held[numbers]
        chosen = self._selection.choose(
            Candidates(
                keep_apart(visible, visibility.points_px, held, self._settings.apart_px),
                visibility.points_px,
                self._shape.points,
                predicted.T_world_target,
                predicted.T_camera_world,
                self._noise[numbers],
                self._diagonal[numbers],
                np.ascontiguousarray(newest.covariance[:6, :6]),
                held,
            ),
            self._settings.budget if newest.certain else self._settings.budget_in_doubt,
        )
        self._held[numbers] = chosen
        return chosen

    def _open(self, predicted: Predicted, chosen: BoolArray, visibility: Visibility) -> Windows:
        """Return the windows around the selected features, of the largest size if it is lost."""
        rule, expected = self._windows.numbers, predicted.expected
        if self._lost:
            rule = (*rule[:2], rule[3], rule[3])
        return Windows(
            *open_windows(
                chosen,
                visibility.points_px,
                predicted.T_world_target,
                predicted.T_camera_world,
                self._shape.points,
                np.array([e.covariance for e in expected]),
                predicted.exposures,
                np.array([1.0 + self._settings.doubt_widens * e.doubt for e in expected]),
                self._rig.lenses,
                self._rig.noise_px,
                predicted.numbers,
                rule,
            )
        )

    def _correct(self, views: list[View]) -> list[IntArray]:
        """Update the pose by all images; return which features of each agree with it."""
        if self._lost or not views:
            return [view.features for view in views]
        self._history, updates = self._history.add_all(views)
        return [
            view.features[update.kept] if update.verdict in JUDGED else view.features
            for view, update in zip(views, updates, strict=True)
        ]

    def _judge(self, time: float, views: list[View], frames: Sequence[Frame]) -> None:
        """Drop a target that contradicts the images for too long; search for a dropped target."""
        belief = self._history.belief
        if not self._lost:
            if belief.seen == belief.time:
                self._last_seen = belief
            unseen = time - max(belief.seen, self._timeout_from)
            if belief.doubts >= self._settings.lost_doubts:
                self._lost = f"{belief.doubts} images in a row contradict the prediction"
            elif unseen > self._settings.lost_after:
                self._lost = f"not seen for {unseen:.2f} s"
        if self._lost:
            self._recover(views, frames)

    def _recover(self, views: list[View], frames: Sequence[Frame]) -> None:
        if self._find is not None:
            views = [view for frame in frames if (view := self._found(frame)) is not None]
        fit = pose_from_points([view for view in views if view.size])
        if isinstance(fit, NoPose):
            return
        self.restart(fit.time, fit.T_world_target, fit.covariance)

    def restart(self, time: float, T_world_target: FloatArray, covariance: FloatArray) -> None:
        """Track the target from a pose on, whatever was believed before.

        Args:
            time: of the pose, s.
            T_world_target: (4, 4).
            covariance: of (δp, δθ), world axes, (6, 6).
        """
        of_all = np.diag(np.repeat([0.0, 0.0, 0.2, 0.5], 3) ** 2)
        of_all[:6, :6] = covariance
        start = self._filter.start(time, T_world_target, covariance=of_all)
        self._history = FilterHistory(self._filter, start, self._settings.horizon)
        self._timeout_from, self._lost = time, ""

    def _found(self, frame: Frame) -> View | None:
        assert self._find is not None
        T_world_camera = self._camera_pose(frame.camera, frame.joints)
        T_camera_target = se3_compose(se3_inverse(T_world_camera), self._last_seen.T_world_target)
        points = self._find(frame, T_camera_target)
        if points is None:
            return None
        camera = self._rig.cameras[self._rig.numbers[frame.camera]]
        return view_of(points, camera, T_world_camera, self._shape.points)


@njit(cache=True)
def seen_from(
    T_world_camera: FloatArray, T_world_target: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return T_camera_world and T_camera_target, (C, 4, 4) each, of C cameras."""
    inverse, relative = np.empty_like(T_world_camera), np.empty_like(T_world_camera)
    for c in range(len(T_world_camera)):
        inverse[c] = se3_inverse(T_world_camera[c])
        relative[c] = se3_compose(inverse[c], T_world_target[c])
    return inverse, relative


def require_size(frame: Frame, image: ImageArray, rig: CameraRig) -> None:
    """Raise InputError if an image does not have the size of its camera's model."""
    camera = rig.cameras[rig.numbers[frame.camera]]
    height, width = image.shape[:2]
    if (width, height) != (camera.width, camera.height):
        given, allowed = f"{width} x {height}", f"{camera.width} x {camera.height}, as calibrated"
        raise InputError(f"camera {frame.camera}", "image", given, allowed)
