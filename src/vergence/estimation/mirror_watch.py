"""The second pose of a flat target, tracked while images cannot exclude it."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from vergence.arrays import FloatArray
from vergence.estimation.filters.measurement import POSE
from vergence.estimation.measure import CameraPose
from vergence.estimation.perception import PosePerception
from vergence.estimation.pose_minima import APART_RAD, PoseMinimum, pose_minima
from vergence.estimation.recovery import LEAST_POINTS, RIVAL
from vergence.estimation.rig import CameraRig
from vergence.estimation.view import Seen, together, view_of
from vergence.geometry import angle_between, pose_difference
from vergence.signals import Frame, Observation, TargetState

_MOST = 2.0 * RIVAL  # limit on the accumulated evidence
_INDEPENDENT = 0.5  # fraction of the evidence that counts: errors of consecutive images correlate
_CLEAR = 3.0 * RIVAL  # χ² difference by which a single image excludes the other pose
_MOST_OF_ONE = 3.0  # evidence of any other image, so that a bad one decides nothing


class MirrorWatch:
    """Supervises a perception of a flat target whose image may fit two poses.

    The second pose is the first one mirrored in depth. Once images have excluded it, it remains
    excluded as long as the two poses are apart, since no motion leads from one to the other. Where
    they meet, with the target seen frontally, the true pose may follow either. The filter continues
    with one of them, and this class accumulates the evidence of each image for it: the difference
    of their χ². Until the odds are a thousand to one, the stated covariance reaches from one pose
    to the other; if the odds turn against the filter, it is restarted at the other pose.

    Args:
        perception: of the target, to be supervised.
        rig: its cameras.
        camera_pose: computes the pose of a camera from the joints at the exposure.
        points: the target's features, (M, 3), m, in one plane.
    """

    def __init__(
        self,
        perception: PosePerception[Any],
        rig: CameraRig,
        camera_pose: CameraPose,
        points: FloatArray,
    ) -> None:
        self._perception, self._rig, self._camera_pose = perception, rig, camera_pose
        self._points = points
        self._evidence = _MOST  # for the filter's pose; the initial pose is certain
        self._doubtful = False

    @property
    def lost(self) -> str:
        """Why the target counts as lost; empty while it is tracked."""
        return self._perception.lost

    @property
    def doubtful(self) -> bool:
        """Whether the last images did not exclude a second pose."""
        return self._doubtful

    def pose_at(self, frame: Frame) -> FloatArray:
        """Return the expected T_world_target (4, 4) at an exposure."""
        return self._perception.pose_at(frame)

    def observe(self, frames: Sequence[Frame]) -> Observation | None:
        """Return the observation in the images and the target's pose, or None without an image."""
        observation = self._perception.observe(frames)
        self._doubtful = False
        if observation is None:
            return None
        if observation.target is None:
            self._evidence = _MOST  # it was found again by images that decide
            return observation
        seen = self._seen(frames, observation)
        if seen.size < LEAST_POINTS:
            return self._with_doubt(observation, None)
        own, rival = _two_poses(seen, observation.target.T_world_target)
        if own is None or rival is None:
            self._evidence = 0.0
            return observation
        scale = max(1.0, min(own.square, rival.square) / max(2 * seen.size - POSE, 1))
        more = (rival.square - own.square) / scale
        said = _MOST if more > _CLEAR else np.clip(_INDEPENDENT * more, -_MOST_OF_ONE, _MOST_OF_ONE)
        self._evidence = float(np.clip(self._evidence + said, -_MOST, _MOST))
        if self._evidence <= -RIVAL:
            self._perception.restart(
                seen.time, rival.pose, scale * np.asarray(np.linalg.inv(rival.information))
            )
            self._evidence, rival = 0.0, own  # so the previous pose is within its covariance
            observation = replace(observation, target=self._perception.state)
        return self._with_doubt(observation, rival)

    def _seen(self, frames: Sequence[Frame], observation: Observation) -> Seen:
        """Return the points that the images contain."""
        joints = {(frame.camera, frame.time): frame.joints for frame in frames}
        views = []
        for view in observation.views:
            camera = self._rig.cameras[self._rig.numbers[view.camera]]
            pose = self._camera_pose(view.camera, joints[view.camera, view.time])
            views.append(view_of(view, camera, pose, self._points))
        return together(views)

    def _with_doubt(self, observation: Observation, rival: PoseMinimum | None) -> Observation:
        """Return the observation, its covariance inflated to the other pose if necessary."""
        target = observation.target
        if rival is None or target is None or self._evidence >= RIVAL:
            return observation
        self._doubtful = True
        return replace(observation, target=_reaching(target, rival.pose))


def _two_poses(seen: Seen, believed: FloatArray) -> tuple[PoseMinimum | None, PoseMinimum | None]:
    """Return the minimum closest to a pose (4, 4), and the best of the others."""
    minima = pose_minima(seen, believed)
    if not minima:
        return None, None
    own = min(minima, key=lambda minimum: angle_between(minimum.pose, believed))
    others = [m for m in minima if m is not own and angle_between(m.pose, own.pose) > APART_RAD]
    return own, others[0] if others else None


def _reaching(target: TargetState, other: FloatArray) -> TargetState:
    """Return a state whose covariance has a pose (4, 4) within one standard deviation."""
    away = np.zeros(len(target.covariance))
    away[:6] = pose_difference(other, target.T_world_target)
    return replace(target, covariance=target.covariance + np.outer(away, away))
