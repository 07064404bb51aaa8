"""Compensates latency and target motion: predicts features to the present, estimates their flow."""

from collections import deque
from functools import partial
from typing import NamedTuple

import numpy as np
from numba import njit

from vergence.arrays import FloatArray
from vergence.control.depth import Depth, Depths, HeldDepth, MeasuredPoints
from vergence.control.depth.depth import in_front
from vergence.control.mounting import CameraMounting
from vergence.control.target_flow import TargetFlow
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


class _Exposure(NamedTuple):
    """The last measured image."""

    time: float  # s
    T_camera_scene: FloatArray  # (4, 4)
    points: FloatArray  # (M, 2) normalized coordinates
    depths: Depths


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
        memory_s: time for which joints are stored; must exceed the latency.
        features: in the target's frame, (M, 3), m; None if unknown.

    Raises:
        InputError: if the depth needs features that are unknown.
    """

    def __init__(
        self,
        arm: Arm,
        mounting: CameraMounting,
        settings: MotionSettings | None = None,
        memory_s: float = 2.0,
        features: FloatArray | None = None,
    ) -> None:
        settings = settings or MotionSettings()
        self._arm, self._mounting, self._memory_s = arm, mounting, memory_s
        self._flow = TargetFlow(settings.flow_smoothing_s if settings.feeds_forward else np.inf)
        self._prediction = settings.prediction
        self._held = isinstance(settings.depth, HeldDepth)
        self._bind = partial(settings.depth.bind, features)
        self._depth_source = self._bind()
        self._history: deque[tuple[float, FloatArray]] = deque()
        self._last: _Exposure | None = None

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
        self._remember(joints)
        points = self._mounting.camera.normalize(view.points_px)
        if self._last is not None and len(points) != len(self._last.points):
            self._last = None  # the features have changed
            self._flow.clear()
            self._depth_source = self._bind()
        if self._last is None or view.time > self._last.time:
            self._expose(view, points, depth, target)
        assert self._last is not None
        exposed = self._last.depths
        if self._held:
            exposed = Depths(depth)
        if not self._prediction:
            return FeatureState(points, self._flow.at(0.0), *exposed)
        q_exposed = self._joints_at(view.time)
        there, here = self._T_camera_scene(q_exposed), self._T_camera_scene(joints.position)
        now = reproject(se3_compose(here, se3_inverse(there)), points, exposed.depth_m)
        elapsed = joints.time - view.time
        ahead = now[:, :2] + self._flow.moved(elapsed)
        moved = np.where(np.isfinite(now[:, 2]), now[:, 2], exposed.depth_m)
        depth_now = depth if self._held else in_front(moved, depth)
        return FeatureState(ahead, self._flow.at(elapsed), depth_now, exposed.share)

    def _expose(
        self,
        view: ImagePoints,
        points: FloatArray,
        depth: FloatArray,
        target: TargetState | None,
    ) -> None:
        """Process a new image: its depths, and the flow that the last one leaves unexplained."""
        T_camera_scene = self._T_camera_scene(self._joints_at(view.time))
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
        depths = self._depth_source.update(measured)
        if self._last is None:
            self._flow.start(len(points))
        else:
            last, elapsed = self._last, view.time - self._last.time
            before = depth if self._held else last.depths.depth_m
            T_now_last = se3_compose(T_camera_scene, se3_inverse(last.T_camera_scene))
            stationary = reproject(T_now_last, last.points, before)
            flow = (points - stationary[:, :2]) / elapsed
            self._flow.measure(flow, view.found, elapsed)
        self._last = _Exposure(view.time, T_camera_scene, points, depths)

    def _T_camera_scene(self, q: FloatArray) -> FloatArray:
        return self._mounting.T_camera_scene(forward_kinematics(self._arm.chain, q))

    def _remember(self, joints: JointState) -> None:
        self._history.append((joints.time, joints.position))
        while self._history[0][0] < joints.time - self._memory_s:
            self._history.popleft()

    def _joints_at(self, time: float) -> FloatArray:
        """Return joint positions at a past time, (n,), interpolated between the stored ones."""
        later = self._history[-1]
        for earlier in reversed(self._history):
            if earlier[0] <= time:
                span = later[0] - earlier[0]
                share = (time - earlier[0]) / span if span > 0 else 0.0
                return earlier[1] + min(share, 1.0) * (later[1] - earlier[1])
            later = earlier
        return later[1]


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
