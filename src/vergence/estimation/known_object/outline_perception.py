"""Tracks an object without sharp edges by its outline, with a camera that may move."""

from collections.abc import Sequence

import numpy as np

from vergence.arrays import FloatArray
from vergence.camera import Camera
from vergence.estimation.known_object.hypothesis_follower import HypothesisFollower
from vergence.estimation.known_object.object_follower import OUTLINE_RULE, Sighting, Step
from vergence.estimation.known_object.object_search import IN_A_LOOP
from vergence.estimation.known_object.object_tracker import ObjectTracker
from vergence.estimation.measure import CameraPose
from vergence.geometry import se3_compose, se3_inverse, transform_points
from vergence.signals import Frame, ImagePoints, Observation, TargetState

_WIDE_PX = 100.0  # stated deviation of points that are not visible


class OutlinePerception:
    """Tracks one target with one camera by its outline; a stage of the loop.

    The filter works in the camera frame; the camera's own motion, known from the joints, is applied
    to its state. A lost target is searched for in whole images, a part of the search for each, and
    found when the poses that explain the images equally well have been excluded.

    Args:
        name: of the camera; images of other cameras are ignored.
        camera: its model.
        tracker: measures the object.
        camera_pose: computes the camera's pose from the joints at the exposure.
        T_world_target: assumed initial pose of the target, (4, 4).
        known: its standard deviation, m and rad.
        begin: time of the first image, s.
        period: between images, s.
        points: that represent the target, in its frame, (M, 3), m.
    """

    def __init__(
        self,
        name: str,
        camera: Camera,
        tracker: ObjectTracker,
        camera_pose: CameraPose,
        T_world_target: FloatArray,
        known: tuple[float, float],
        begin: float,
        period: float,
        points: FloatArray,
    ) -> None:
        self._name, self._camera, self._tracker = name, camera, tracker
        self._camera_pose, self._points = camera_pose, points
        self._start, self._known, self._begin, self._period = T_world_target, known, begin, period
        self._follower: HypothesisFollower | None = None
        self._T_world_camera = np.eye(4)  # at the last image
        self._last_seen = T_world_target
        self._lost = ""

    @property
    def lost(self) -> str:
        """Why the target counts as lost; empty while it is tracked."""
        return self._lost

    def pose_at(self, frame: Frame) -> FloatArray:
        """Return the last T_world_target (4, 4)."""
        return self._last_seen

    def observe(self, frames: Sequence[Frame]) -> Observation | None:
        """Return the observation in the images and the target's pose, or None without an image."""
        own = [f for f in frames if f.camera == self._name and f.image is not None]
        if not own:
            return None
        views, state = [], None
        for frame in sorted(own, key=lambda f: f.time):
            step = self._follow(frame)
            views.append(self._view(frame, step))
            state = None if self._lost else self._state(step)
        return Observation(views[-1].time, tuple(views), state)

    def _follow(self, frame: Frame) -> Step:
        assert frame.image is not None
        T_world_camera = self._camera_pose(self._name, frame.joints)
        T_camera_world = se3_inverse(T_world_camera)
        if self._follower is None:
            self._follower = HypothesisFollower(
                self._tracker,
                self._camera,
                [se3_compose(T_camera_world, self._start)],
                self._begin,
                self._period,
                OUTLINE_RULE,
                known=self._known,
                pace=IN_A_LOOP,
            )
        else:
            self._follower.carry(se3_compose(T_camera_world, self._T_world_camera))
        self._T_world_camera = T_world_camera
        step = self._follower.follow(frame.image, frame.time)
        if step.sighting is Sighting.SEEN:
            self._last_seen, self._lost = se3_compose(T_world_camera, step.T_camera_target), ""
        elif step.sighting is not Sighting.PREDICTED:
            self._lost = step.reason
        return step

    def _state(self, step: Step) -> TargetState:
        """Return the estimate in world axes."""
        turn = np.kron(np.eye(4), self._T_world_camera[:3, :3])
        return TargetState(
            step.time,
            se3_compose(self._T_world_camera, step.T_camera_target),
            turn[:6, :6] @ step.velocity,
            np.ascontiguousarray(turn @ step.covariance @ turn.T),
            step.sighting is Sighting.SEEN,
        )

    def _view(self, frame: Frame, step: Step) -> ImagePoints:
        """Return the points that represent the target, with covariances from that of its pose."""
        seen = step.sighting is Sighting.SEEN
        place = transform_points(step.T_camera_target, self._points.copy())
        front = place[:, 2] > 0.0
        points_px = np.zeros((len(place), 2))
        points_px[front] = self._camera.project(place[front])
        covariance = np.tile(_WIDE_PX**2 * np.eye(2), (len(place), 1, 1))
        if seen:
            covariance[front] = self._spread(place[front], step)
        found = front & seen & self._camera.in_view(place)
        reason = step.reason or "out of the image"
        reasons = tuple("" if ok else reason for ok in found)
        return ImagePoints(self._name, frame.time, points_px, covariance, found, reasons)

    def _spread(self, place: FloatArray, step: Step) -> FloatArray:
        """Return the covariances (M, 2, 2), px², of points (M, 3) in the camera, by the pose's."""
        aside = place - step.T_camera_target[:3, 3]
        depth = place[:, 2, None, None]
        slope = np.zeros((len(place), 2, 3))  # of the image points by the places
        slope[:, 0, 0], slope[:, 1, 1] = self._camera.focal_px
        slope[:, :, 2] = -place[:, :2] / place[:, 2:] * self._camera.focal_px
        J = np.concatenate((slope, np.cross(aside[:, None], slope)), axis=2) / depth
        covariance: FloatArray = J @ step.covariance[:6, :6] @ J.transpose(0, 2, 1)
        return covariance
