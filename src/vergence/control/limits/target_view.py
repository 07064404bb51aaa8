"""The corners of a target of known shape that must stay in view."""

from dataclasses import replace

import numpy as np
from numba import njit

from vergence.arrays import BoolArray, FloatArray, frozen
from vergence.control.mounting import CameraMounting
from vergence.control.moving_pose import MovingPose, moved
from vergence.estimation.feature_faces import FeatureFaces, faces_in_view
from vergence.geometry import se3_compose, se3_inverse, transform_points
from vergence.signals import TargetState

_SIGMAS = 2.0  # standard deviations of a corner's position that are allowed for


class TargetView:
    """The corners of a target as a camera is expected to see them, also between images.

    Their positions follow from the estimated pose, extrapolated at the estimated velocity; their
    possible errors follow from the covariance of that pose. Corners that are not visible at the
    desired pose are ignored. For a fixed camera, the pose is kept in the frame of the arm's tip,
    which holds the target.

    Args:
        mounting: of the camera.
        corners: of the target, in its own frame, (M, 3), m.
        faces: with the corners, in the same frame; None if unknown.
        low: lower bounds of the view, normalized coordinates, (2,).
        high: upper bounds, (2,).
    """

    def __init__(
        self,
        mounting: CameraMounting,
        corners: FloatArray,
        low: FloatArray,
        high: FloatArray,
        faces: FeatureFaces | None = None,
    ) -> None:
        self._mounting, self._low, self._high = mounting, low, high
        self._corners = self._kept = frozen(corners, (None, 3), "corners")
        self._target = MovingPose(np.eye(4), np.zeros(6))
        self._covariance = np.zeros((6, 6))
        self._faces = self._faces_kept = faces
        self._eye_desired = np.zeros((1, 3))

    def see(self, target: TargetState, T_camera_target: FloatArray, now: float) -> None:
        """Process a new estimate of the target.

        Args:
            target: the estimate.
            T_camera_target: desired pose of the target in the camera, (4, 4).
            now: time of the joints, s; the target has moved since its image.
        """
        if self._mounting.is_fixed:
            target = _held(target)
        seen = MovingPose(target.T_world_target, target.velocity)
        self._target = MovingPose(moved(seen, now - target.time), target.velocity)
        self._covariance = np.ascontiguousarray(target.covariance[:6, :6])
        shown = self._shown(T_camera_target)
        self._kept = self._corners[shown]
        if self._faces is not None:
            self._faces_kept = self._faces.only(shown)
            self._eye_desired = se3_inverse(T_camera_target)[None, :3, 3].copy()

    def features(self, T_world_tip: FloatArray) -> FloatArray:
        """Return the corners as the camera sees them at a pose of the arm's tip, (M, 7)."""
        T = self._mounting.T_camera_scene(T_world_tip)
        rows: FloatArray = pose_features(T, *self._target, self._kept, self._covariance)
        return rows

    def faces(self, T_world_tip: FloatArray) -> FloatArray | None:
        """Return the faces that show the corners now and as desired, in the camera frame, (F, 6).

        None if no faces are known.
        """
        known = self._faces_kept
        if known is None:
            return None
        T = se3_compose(self._mounting.T_camera_scene(T_world_tip), self._target.T)
        faces: FloatArray = faces_in_view(T, known.planes, known.holds, self._eye_desired)
        return faces

    def advance(self, period_s: float) -> None:
        """Extrapolate the target by a time step."""
        self._target = MovingPose(moved(self._target, period_s), self._target.twist)

    def _shown(self, T_camera_target: FloatArray) -> BoolArray:
        """Return which corners are visible within the margin at the desired pose, (M,)."""
        points = transform_points(T_camera_target, self._corners)
        with np.errstate(divide="ignore", invalid="ignore"):
            image = points[:, :2] / points[:, 2:]
        inside = (image > self._low) & (image < self._high)
        shown: BoolArray = inside.all(axis=1) & (points[:, 2] > 0)
        return shown


def _held(target: TargetState) -> TargetState:
    """Return the target in the frame of the tip that holds it."""
    assert target.T_world_tip is not None
    turn = np.kron(np.eye(4), target.T_world_tip[:3, :3].T)
    return replace(
        target,
        T_world_target=se3_compose(se3_inverse(target.T_world_tip), target.T_world_target),
        velocity=turn[:6, :6] @ target.velocity,
        covariance=turn @ target.covariance @ turn.T,
    )


@njit(cache=True, error_model="numpy")
def pose_features(
    T_camera_scene: FloatArray,
    T_scene_target: FloatArray,
    velocity: FloatArray,
    corners: FloatArray,
    covariance: FloatArray,
) -> FloatArray:
    """Return the corners of a target as a camera sees them, as by `pack_features`, (M, 7).

    With r a corner's lever from the target's origin and P = R_camera_scene [I, -[r]×], the corner
    moves with P twist in the camera, and its position has the covariance P Σ Pᵀ; both are projected
    with ∂(x, y)/∂p = [I, -(x, y)ᵀ] / Z. A corner behind the camera gets depth 0.

    Args:
        T_camera_scene: pose of the frame that the target's pose is given in, (4, 4).
        T_scene_target: (4, 4).
        velocity: (6,) of the target's origin, and angular, along that frame's axes.
        corners: in the target's frame, (M, 3).
        covariance: of position and rotation, along the same axes, (6, 6).
    """
    features = np.zeros((len(corners), 7))
    P, row = np.zeros((3, 6)), np.zeros(6)
    for j in range(len(corners)):
        lever, p = np.zeros(3), np.zeros(3)
        for a in range(3):
            for b in range(3):
                lever[a] += T_scene_target[a, b] * corners[j, b]
        for a in range(3):
            p[a] = T_camera_scene[a, 3]
            for b in range(3):
                p[a] += T_camera_scene[a, b] * (lever[b] + T_scene_target[b, 3])
                P[a, b] = T_camera_scene[a, b]
            turn = T_camera_scene[a]
            P[a, 3] = turn[2] * lever[1] - turn[1] * lever[2]
            P[a, 4] = turn[0] * lever[2] - turn[2] * lever[0]
            P[a, 5] = turn[1] * lever[0] - turn[0] * lever[1]
        if not p[2] > 0.0:
            continue
        features[j, 4] = p[2]
        for a in range(2):
            features[j, a] = p[a] / p[2]
            variance = 0.0
            for k in range(6):
                row[k] = (P[a, k] - features[j, a] * P[2, k]) / p[2]
                features[j, 2 + a] += row[k] * velocity[k]
            for k in range(6):
                for i in range(6):
                    variance += row[k] * covariance[k, i] * row[i]
            features[j, 5 + a] = _SIGMAS * np.sqrt(max(variance, 0.0))
    return features
