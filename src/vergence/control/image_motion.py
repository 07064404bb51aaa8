"""Where the features are now, and how fast the target moves them: latency and motion undone."""

from collections import deque
from typing import NamedTuple

import numpy as np
from numba import njit

from vergence.arrays import FloatArray
from vergence.control.mounting import CameraMounting
from vergence.geometry import se3_compose, se3_inverse
from vergence.robot import Arm, forward_kinematics
from vergence.signals import ImagePoints, JointState

_LEAST_DEPTH = 0.1  # of the depth believed at first


class FeatureState(NamedTuple):
    """The features as they should look at this instant."""

    points: FloatArray  # (M, 2) normalized coordinates, now
    flow: FloatArray  # (M, 2) their motion by the target's own, 1/s
    depth: FloatArray  # (M,) m, as believed


class MotionSettings(NamedTuple):
    """What is assumed of the features between their exposure and now.

    Attributes:
        feed_forward: whether the target's own motion is estimated and fed forward; else the target
            is taken for stationary.
        prediction: whether features are carried from their exposure to now; else they are taken as
            they are, late.
        flow_smoothing_s: time constant of the target's motion in the image, s.
        carries_depth: whether the depth of the start is updated from the camera's motion, which is
            right for a stationary target; else it stays as given.
    """

    feed_forward: bool = True
    prediction: bool = True
    flow_smoothing_s: float = 0.1
    carries_depth: bool = False


class ImageMotion:
    """Carries measured features from their exposure to now, through the camera's known motion.

    A feature seen at exposure is lifted to its depth, moved with the camera's motion since, which
    the joints tell, and projected again; what consecutive images then leave unexplained is the
    target's own motion, smoothed to a flow and extrapolated. So a servo acts on the present
    although images are late, and can feed the target's motion forward.

    Args:
        arm: up to its tip.
        mounting: of the camera.
        settings: what is assumed.
        memory_s: how far back the joints are remembered; more than the latency.
    """

    def __init__(
        self,
        arm: Arm,
        mounting: CameraMounting,
        settings: MotionSettings | None = None,
        memory_s: float = 2.0,
    ) -> None:
        settings = settings or MotionSettings()
        self._arm, self._mounting, self._memory_s = arm, mounting, memory_s
        self._smoothing_s = settings.flow_smoothing_s if settings.feed_forward else np.inf
        self._prediction, self._carries_depth = settings.prediction, settings.carries_depth
        self._history: deque[tuple[float, FloatArray]] = deque()
        self._last: tuple[float, FloatArray, FloatArray] | None = None  # time, q, points
        self._flow: FloatArray | None = None
        self._depth: FloatArray | None = None  # at the last exposure

    def update(self, view: ImagePoints, depth: FloatArray, joints: JointState) -> FeatureState:
        """Take in a view and return the features now.

        Args:
            view: the newest measurement.
            depth: of the features, (M,), m; if it is carried on, as it was at the first view.
            joints: now.
        """
        self._remember(joints)
        q_exposed = self._joints_at(view.time)
        points = self._mounting.camera.normalize(view.points_px)
        flow, exposed_depth = self._update(view, points, depth, q_exposed)
        if not self._prediction:
            return FeatureState(points, flow, exposed_depth)
        now = self._seen_from(points, exposed_depth, q_exposed, joints.position)
        ahead = now[:, :2] + flow * (joints.time - view.time)
        return FeatureState(ahead, flow, _least(now[:, 2], depth) if self._carries_depth else depth)

    def _update(
        self, view: ImagePoints, points: FloatArray, depth: FloatArray, q: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Take in a view; return the flow (M, 2) and the depth (M,) at its exposure."""
        if self._last is not None and len(points) != len(self._last[2]):
            self._last = self._flow = self._depth = None  # other features
        if self._depth is None or not self._carries_depth:
            self._depth = depth
        if self._flow is None:
            self._flow = np.zeros_like(points)
        if self._last is not None and view.time > self._last[0]:
            time, q_last, points_last = self._last
            elapsed = view.time - time
            stationary = self._seen_from(points_last, self._depth, q_last, q)
            share = elapsed / (elapsed + self._smoothing_s)
            change = share * ((points - stationary[:, :2]) / elapsed - self._flow)
            known = view.found & np.isfinite(change).all(axis=1)
            self._flow = self._flow + np.where(known[:, None], change, 0.0)
            if self._carries_depth:
                carried = np.where(np.isfinite(stationary[:, 2]), stationary[:, 2], self._depth)
                self._depth = _least(carried, depth)
        self._last = (view.time, q, points)
        return self._flow, self._depth

    def _seen_from(
        self, points: FloatArray, depth: FloatArray, q_from: FloatArray, q_to: FloatArray
    ) -> FloatArray:
        """Return stationary points (M, 3), seen at one configuration, as they look at another."""
        there, here = (
            self._mounting.T_camera_scene(forward_kinematics(self._arm.chain, q))
            for q in (q_to, q_from)
        )
        seen: FloatArray = reproject(se3_compose(there, se3_inverse(here)), points, depth)
        return seen

    def _remember(self, joints: JointState) -> None:
        self._history.append((joints.time, joints.position))
        while self._history[0][0] < joints.time - self._memory_s:
            self._history.popleft()

    def _joints_at(self, time: float) -> FloatArray:
        """Return joint positions at a past instant, (n,), between the remembered ones."""
        later = self._history[-1]
        for earlier in reversed(self._history):
            if earlier[0] <= time:
                span = later[0] - earlier[0]
                share = (time - earlier[0]) / span if span > 0 else 0.0
                return earlier[1] + min(share, 1.0) * (later[1] - earlier[1])
            later = earlier
        return later[1]


def _least(carried: FloatArray, believed: FloatArray) -> FloatArray:
    """Keep a carried depth (M,) in front of the camera, though it was believed too small."""
    return np.maximum(carried, _LEAST_DEPTH * believed)


@njit(cache=True, error_model="numpy")
def reproject(T_to_from: FloatArray, points: FloatArray, depth: FloatArray) -> FloatArray:
    """Return stationary points as another camera pose sees them: x, y and their depth, (M, 3).

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
