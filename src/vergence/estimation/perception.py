"""Predict-select-measure-update tracking loop."""

from collections.abc import Callable, Sequence
from typing import Generic

import numpy as np

from vergence.arrays import BoolArray, FloatArray, IntArray
from vergence.camera.lens import HEIGHT, WIDTH
from vergence.errors import InputError
from vergence.estimation.history import FilterHistory
from vergence.estimation.looks import Expected, Look, PredictedFrame
from vergence.estimation.measure import (
    CameraPose,
    Find,
    Joints,
    Measure,
    nothing_found,
    nothing_measured,
    spread_out,
)
from vergence.estimation.perception_settings import PerceptionSettings
from vergence.estimation.recovery import NoPose, pose_from_points
from vergence.estimation.rig import CameraRig, normalized_noise
from vergence.estimation.selection import Candidates, InformationSelection, Selection
from vergence.estimation.spacing import keep_apart
from vergence.estimation.target_filter import B, TargetFilter, Verdict, state_of
from vergence.estimation.target_shape import TargetShape
from vergence.estimation.view import View, view_of
from vergence.estimation.visibility import (
    Blocked,
    Visibility,
    add_obstacles,
    predict_visibility,
)
from vergence.estimation.windows import WindowRule, innovation_spread
from vergence.geometry import se3_compose, se3_inverse, transform_points
from vergence.signals import Frame, ImagePoints, Observation, TargetState

DOUBT = 0.4  # share of the last points that disagreed, from which more of them are measured
JUDGED = (Verdict.USED, Verdict.RECOVERED, Verdict.CONTRADICTED)


class PosePerception(Generic[B]):
    """Follows one target with any number of cameras; a stage of the loop.

    For every image that arrives: the target's pose is predicted to its exposure, the features the
    camera will see are worked out, the few worth measuring chosen over all cameras together, and
    only small windows around them looked at; what is found there corrects the pose, the images of
    one exposure together.
    [Lippiello2005] section IV, Fig. 3.

    A target that is lost is searched for around the place where it was seen last, with the widest
    windows, and over whole images if `find` is given; while it is lost no pose is reported, and
    no point counts as found.
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
        blocked_at: Callable[[Joints], Blocked] | None = None,
        find: Find | None = None,
    ) -> None:
        """Prepare to follow a target.

        Args:
            rig: the cameras.
            shape: the target.
            camera_pose: gives the pose of a camera from the joints at the exposure.
            measure: finds features inside windows.
            target_filter: `PoseFilter`, or `RpyPoseFilter` for the paper's.
            start: what is believed at first, of that filter.
            selection: how features are chosen; by information unless told.
            windows: how large windows are.
            settings: budget and limits on missed images.
            blocked_at: gives, for the joints at an exposure, the function that returns what is
                between a camera and points of the target; the target itself must not count.
            find: finds the target in a whole image, when it is lost.
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
        self._held: dict[str, BoolArray] = {}
        self._lost = ""

    @property
    def belief(self) -> B:
        """What is believed after the newest image."""
        return self._history.belief

    @property
    def lost(self) -> str:
        """Why the target counts as lost; empty while it is followed."""
        return self._lost

    @property
    def state(self) -> TargetState:
        """What is believed after the newest image, as it is passed on."""
        return state_of(self.belief)

    def observe(self, frames: Sequence[Frame]) -> Observation | None:
        """Return what the images show and where the target is, or None without an image.

        Images of cameras that are not in the rig do not concern it.

        Raises:
            InputError: if an image has not the size that its camera's model is for.
        """
        known = [frame for frame in frames if frame.camera in self._rig.numbers]
        if not known:
            return None
        beliefs = {time: self._expected(time) for time in {frame.time for frame in known}}
        predictions = [
            self._expect(frame, beliefs[frame.time])
            for frame in sorted(known, key=lambda f: (f.time, f.camera))
        ]
        visibility = self._see(predictions)
        chosen = self._choose(predictions, visibility)
        looks = [
            self._look(predictions[n], n, chosen[n], visibility.points_px[n])
            for n in np.flatnonzero(chosen.any(axis=1)).tolist()  # no other is even touched
        ]
        agreeing = self._correct(looks)
        time = predictions[-1].frame.time
        self._judge(
            time, [look.view for look in looks], [prediction.frame for prediction in predictions]
        )
        points = self._points(predictions, visibility, looks, agreeing)
        return Observation(time, points, None if self._lost else state_of(self.belief))

    def _expected(self, time: float) -> Expected:
        belief = self._last_seen if self._lost else self._history.at(time)
        doubt = belief.disagreeing
        certain = belief.consistency.holds and doubt < DOUBT
        return Expected(belief.T_world_target, belief.honest_covariance, doubt, certain)

    def _expect(self, frame: Frame, expected: Expected) -> PredictedFrame:
        require_size(frame, self._rig)
        number = self._rig.numbers[frame.camera]
        T_world_camera = self._camera_pose(frame.camera, frame.joints)
        return PredictedFrame(frame, number, T_world_camera, se3_inverse(T_world_camera), *expected)

    def _see(self, predictions: list[PredictedFrame]) -> Visibility:
        T_camera_target = np.array(
            [se3_compose(p.T_camera_world, p.T_world_target) for p in predictions]
        )
        visibility = predict_visibility(
            self._shape,
            T_camera_target,
            self._rig.lenses[[p.number for p in predictions]],
            margin_px=self._settings.margin_px,
            least_cosine=self._settings.least_cosine,
        )
        if self._blocked_at is not None:
            for status, p in zip(visibility.status, predictions, strict=True):
                blocked = self._blocked_at(p.frame.joints)
                world = transform_points(p.T_world_target, self._shape.points)
                add_obstacles(status, blocked, p.T_world_camera[:3, 3], world)
        return visibility

    def _choose(self, predictions: list[PredictedFrame], visibility: Visibility) -> BoolArray:
        if self._lost:
            return visibility.visible
        none = np.zeros(len(self._shape.points), dtype=np.bool_)
        numbers = [p.number for p in predictions]
        held = np.array([self._held.get(p.frame.camera, none) for p in predictions])
        chosen = self._selection.choose(
            Candidates(
                keep_apart(visibility.visible, visibility.points_px, held, self._settings.apart_px),
                visibility.points_px,
                self._shape.points,
                np.array([p.T_world_target for p in predictions]),
                np.array([p.T_camera_world for p in predictions]),
                self._noise[numbers],
                self._diagonal[numbers],
                np.ascontiguousarray(predictions[-1].covariance[:6, :6]),
                held,
            ),
            self._settings.budget if predictions[-1].certain else self._settings.budget_in_doubt,
        )
        for prediction, mask in zip(predictions, chosen, strict=True):
            self._held[prediction.frame.camera] = mask
        return chosen

    def _look(
        self, prediction: PredictedFrame, n: int, chosen: BoolArray, expected: FloatArray
    ) -> Look:
        """Measure the features chosen inside windows."""
        features = np.flatnonzero(chosen)
        half_px = self._half_sizes(prediction, features)
        found = self._measure(
            prediction.frame,
            features,
            expected[features],
            half_px,
            se3_compose(prediction.T_camera_world, prediction.T_world_target),
        )
        camera = self._rig.cameras[prediction.number]
        view = view_of(found, camera, prediction.T_world_camera, self._shape.points, features)
        return Look(n, features, half_px, found, view)

    def _correct(self, looks: list[Look]) -> list[IntArray]:
        """Correct the pose by all images; return which features of each agree with it."""
        if self._lost or not looks:
            return [look.view.features for look in looks]
        self._history, updates = self._history.add_all([look.view for look in looks])
        return [
            look.view.features[update.kept] if update.verdict in JUDGED else look.view.features
            for look, update in zip(looks, updates, strict=True)
        ]

    def _points(
        self,
        predictions: list[PredictedFrame],
        visibility: Visibility,
        looks: list[Look],
        agreeing: list[IntArray],
    ) -> tuple[ImagePoints, ...]:
        """Return what became of every feature; of a target that is lost, none is found."""
        expected, status, widest = visibility.points_px, visibility.status, self._windows.most_px
        points = {
            look.number: spread_out(look, kept, expected[look.number], status[look.number], widest)
            for look, kept in zip(looks, agreeing, strict=True)
        }
        for n, prediction in enumerate(predictions):
            if n not in points:
                frame = prediction.frame
                points[n] = nothing_measured(
                    frame.camera, frame.time, expected[n], status[n], widest
                )
        every = (points[n] for n in range(len(predictions)))
        return tuple(nothing_found(p, self._lost) for p in every) if self._lost else tuple(every)

    def _half_sizes(self, prediction: PredictedFrame, features: IntArray) -> FloatArray:
        if self._lost:
            return np.full((len(features), 2), self._windows.most_px)
        spread = innovation_spread(
            prediction.T_world_target,
            prediction.T_camera_world,
            self._shape.points[features],
            prediction.covariance,
        )
        camera, noise = self._rig.cameras[prediction.number], self._rig.noise_px[prediction.number]
        scale = 1.0 + self._settings.doubt_widens * prediction.doubt
        return self._windows.half_sizes(spread, camera.focal_px, float(noise), scale)

    def _judge(self, time: float, views: list[View], frames: list[Frame]) -> None:
        """Drop a target that contradicts the images for too long; search for a dropped one."""
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

    def _recover(self, views: list[View], frames: list[Frame]) -> None:
        if self._find is not None:
            views = [view for frame in frames if (view := self._found(frame)) is not None]
        fit = pose_from_points([view for view in views if view.size])
        if isinstance(fit, NoPose):
            return
        self.restart(fit.time, fit.T_world_target, fit.covariance)

    def restart(self, time: float, T_world_target: FloatArray, covariance: FloatArray) -> None:
        """Follow the target from a pose on, whatever was believed before.

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
        points = self._find(frame)
        if points is None:
            return None
        camera = self._rig.cameras[self._rig.numbers[frame.camera]]
        T_world_camera = self._camera_pose(frame.camera, frame.joints)
        return view_of(points, camera, T_world_camera, self._shape.points)


def require_size(frame: Frame, rig: CameraRig) -> None:
    """Raise InputError if an image has not the size that its camera's model is for."""
    if frame.image is None:
        return
    camera = rig.cameras[rig.numbers[frame.camera]]
    height, width = frame.image.shape[:2]
    if (width, height) != (camera.width, camera.height):
        given, allowed = f"{width} x {height}", f"{camera.width} x {camera.height}, as calibrated"
        raise InputError(f"camera {frame.camera}", "image", given, allowed)
