"""Compensates latency and target motion: predicts features to the present, estimates their flow."""

from functools import partial
from typing import NamedTuple

import numpy as np
from numba import njit

from vergence.arrays import FloatArray
from vergence.control.depth import Depth, Depths, HeldDepth, MeasuredPoints
from vergence.control.depth.depth import in_front
from vergence.control.mounting import CameraMounting
from vergence.control.past_joints import no_joints, past_position, remember
from vergence.control.target_flow import FlowState, TargetFlow, flow_at
from vergence.geometry import se3_compose, se3_inverse
from vergence.robot import Arm, forward_kinematics
from vergence.signals import ImagePoints, JointState, TargetState


class FeatureState(NamedTuple):
    """The predicted features at the present time."""

    points: FloatArray  # (M, 2) normalized coordinates, now
    flow: FloatArray  # (M, 2) flow caused by the target's own motion, 1/s
    depth: FloatArray  # (M,) m, believed
    depth_share: float = float("nan")  # largest relative deviation of the depth; NaN if unknown


class MotionSettings(NamedTuple):
    """Assumptions about the features between their exposure and the present.

    Attributes:
        feed_forward: whether the target's own motion is estimated and fed forward; if false, the
            target is assumed stationary. None means true if the depth is right for a moving target,
            because a wrong depth causes an apparent motion that would be fed forward as well.
        prediction: whether features are predicted from their exposure to the present; if false,
            they are used as measured, late.
        flow_smoothing_s: time constant of the target's motion in the image, s; see `TargetFlow`.
        depth: source of the features' depth.
    """

    feed_forward: bool | None = None
    prediction: bool = True
    flow_smoothing_s: float = 0.2
    depth: Depth = HeldDepth()

    @property
    def feeds_forward(self) -> bool:
        """Whether the target's own motion is fed forward."""
        if self.feed_forward is None:
            return self.depth.estimates_motion
        return self.feed_forward

    @property
    def as_it_is(self) -> bool:
        """Whether features and depth are used as measured."""
        return not (self.feeds_forward or self.prediction) and isinstance(self.depth, HeldDepth)


class ExposedFeatures(NamedTuple):
    """The features in the last measured image."""

    time: float  # s, of its exposure
    T_camera_scene: FloatArray  # (4, 4)
    points: FloatArray  # (M, 2) normalized coordinates
    depth_m: FloatArray  # (M,)
    share: float  # largest relative deviation of the depth; NaN if unknown


class ImageMotion:
    """Predicts measured features from their exposure to the present, through known camera motion.

    A feature measured at an exposure is lifted to its depth, moved with the camera's motion since
    then, which the joints determine, and projected again. What consecutive images leave unexplained
    is the target's own motion, smoothed to a flow with its trend and extrapolated. A servo can
    therefore act on the present although images are late, and feed the target's motion forward.

    Args:
        arm: up to its tip.
        mounting: of the camera.
        settings: the assumptions.
        features: in the target's frame, (M, 3), m; None if unknown.

    Raises:
        InputError: if the depth needs features that are unknown.
    """

    def __init__(
        self,
        arm: Arm,
        mounting: CameraMounting,
        settings: MotionSettings | None = None,
        features: FloatArray | None = None,
    ) -> None:
        settings = settings or MotionSettings()
        self._arm, self._mounting = arm, mounting
        self._flow = TargetFlow(settings.flow_smoothing_s if settings.feeds_forward else np.inf)
        self._prediction = settings.prediction
        self._held = isinstance(settings.depth, HeldDepth)
        self._bind = partial(settings.depth.bind, features)
        self._depth_source = self._bind()
        self._joints = no_joints(arm.joint_count)
        self._last: ExposedFeatures | None = None

    def update(
        self,
        view: ImagePoints,
        depth: FloatArray,
        joints: JointState,
        target: TargetState | None = None,
    ) -> FeatureState:
        """Process an image's features and return them at the present time.

        Args:
            view: the newest measurement.
            depth: of the features, (M,), m, as believed without any measurement.
            joints: now.
            target: from a filter, if one runs.
        """
        remember(self._joints, joints.time, joints.position)
        depth = np.array(depth)  # writeable and contiguous, as the kernels expect
        points = self._mounting.camera.normalize(view.points_px)
        if self._last is not None and len(points) != len(self._last.points):
            self._last = None  # the features have changed
            self._flow.clear()
            self._depth_source = self._bind()
        if self._last is None or view.time > self._last.time:
            self._expose(view, points, depth, target)
        assert self._last is not None
        exposed = self._last._replace(points=points)
        if self._held:
            exposed = exposed._replace(depth_m=depth)
        if not self._prediction:
            return FeatureState(points, self._flow.at(0.0), exposed.depth_m, exposed.share)
        here, elapsed = self._T_camera_scene(joints.position), joints.time - view.time
        now: FeatureState = predicted_features(exposed, self._flow.state, here, depth, elapsed)
        return now._replace(depth=depth) if self._held else now

    def _expose(
        self,
        view: ImagePoints,
        points: FloatArray,
        depth: FloatArray,
        target: TargetState | None,
    ) -> None:
        """Process a new image: its depths, and the flow that the last one leaves unexplained."""
        T_camera_scene = self._T_camera_scene(past_position(self._joints, view.time))
        measured = MeasuredPoints(
            view.time,
            points,
            view.found,
            view.covariance_px / np.outer(*2 * [self._mounting.camera.focal_px]),
            T_camera_scene,
            depth,
            target,
            view.depth_m,
            view.depth_deviation_m,
        )
        depths: Depths = self._depth_source.update(measured)
        if self._last is None:
            self._flow.start(len(points))
        else:
            last, elapsed = self._last, view.time - self._last.time
            before = last._replace(depth_m=depth) if self._held else last
            flow = unexplained_flow(before, T_camera_scene, points, elapsed)
            self._flow.measure(flow, view.found, elapsed)
        self._last = ExposedFeatures(view.time, T_camera_scene, points, *depths)

    def _T_camera_scene(self, q: FloatArray) -> FloatArray:
        return self._mounting.T_camera_scene(forward_kinematics(self._arm.chain, q))


@njit(cache=True, error_model="numpy")
def unexplained_flow(
    last: ExposedFeatures, T_camera_scene: FloatArray, points: FloatArray, elapsed_s: float
) -> FloatArray:
    """Return the image motion (M, 2), 1/s, that the camera's own motion does not explain.

    Args:
        last: the image before.
        T_camera_scene: at this image, (4, 4).
        points: in it, normalized coordinates, (M, 2).
        elapsed_s: between the two.
    """
    T_now_last = se3_compose(T_camera_scene, se3_inverse(last.T_camera_scene))
    stationary = reproject(T_now_last, last.points, last.depth_m)
    return (points - stationary[:, :2]) / elapsed_s


@njit(cache=True, error_model="numpy")
def predicted_features(
    exposed: ExposedFeatures,
    flow: FlowState,
    T_camera_scene: FloatArray,
    believed_m: FloatArray,
    elapsed_s: float,
) -> FeatureState:
    """Return features at the present time.

    Args:
        exposed: the newest image.
        flow: of the target's own motion.
        T_camera_scene: now, (4, 4).
        believed_m: depth at the start, (M,), which bounds the depth from below.
        elapsed_s: since the exposure.
    """
    T_now_exposed = se3_compose(T_camera_scene, se3_inverse(exposed.T_camera_scene))
    now = reproject(T_now_exposed, exposed.points, exposed.depth_m)
    ahead = now[:, :2] + elapsed_s * flow_at(flow, 0.5 * elapsed_s)
    depth_m = exposed.depth_m.copy()
    for j in range(len(now)):
        if np.isfinite(now[j, 2]):
            depth_m[j] = now[j, 2]
    depth_m = in_front(depth_m, believed_m)
    return FeatureState(ahead, flow_at(flow, elapsed_s), depth_m, exposed.share)


@njit(cache=True, error_model="numpy")
def reproject(T_to_from: FloatArray, points: FloatArray, depth: FloatArray) -> FloatArray:
    """Return stationary points as seen from another camera pose: x, y and depth, (M, 3).

    Args:
        T_to_from: pose of the first camera in the second, (4, 4).
        points: normalized coordinates in the first, (M, 2).
        depth: in the first, (M,), m.
    """
    seen = np.empty((len(points), 3))
    for j in range(len(points)):
        x, y, z = points[j, 0] * depth[j], points[j, 1] * depth[j], depth[j]
        behind = T_to_from[2, 0] * x + T_to_from[2, 1] * y + T_to_from[2, 2] * z + T_to_from[2, 3]
        for a in range(2):
            seen[j, a] = (
                T_to_from[a, 0] * x + T_to_from[a, 1] * y + T_to_from[a, 2] * z + T_to_from[a, 3]
            ) / max(behind, 1e-9)
        seen[j, 2] = behind
    return seen
