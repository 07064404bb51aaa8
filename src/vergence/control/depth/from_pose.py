"""Depth from the target's pose as estimated by a filter."""

import numpy as np
from numba import njit

from vergence.arrays import FloatArray
from vergence.control.depth.depth import Depths, MeasuredPoints, in_front
from vergence.errors import InputError
from vergence.parts import part


@part("depth", "from_pose")
class DepthFromPose:
    """The depth of known features at the pose that the filter estimates."""

    @property
    def estimates_motion(self) -> bool:
        """True: the filter tracks a moving target."""
        return True

    def bind(self, features: FloatArray | None) -> "PoseSource":
        """Return a source for one camera.

        Raises:
            InputError: if the features are not known.
        """
        if features is None:
            raise InputError("law", "depth", "from_pose", "for known features: target.features")
        return PoseSource(features)


class PoseSource:
    """Computes the features' depths from the filter's pose.

    Args:
        features: in the target's frame, (M, 3), m.
    """

    def __init__(self, features: FloatArray) -> None:
        self._features = features

    def update(self, exposure: MeasuredPoints) -> Depths:
        """Return the depths at the estimated pose, or the believed ones if there is none."""
        target = exposure.target
        if target is None:
            return Depths(exposure.believed_m)
        return depths_at(exposure, target.T_world_target, target.covariance[:6, :6], self._features)


def depths_at(
    exposure: MeasuredPoints,
    T_scene_target: FloatArray,
    covariance: FloatArray,
    features: FloatArray,
) -> Depths:
    """Return the depths of features at a pose, with their deviation.

    With a the lever of a feature and r the camera's optical axis, in scene axes,
    δz = r·δp + (a × r)·δθ.

    Args:
        exposure: of the image.
        T_scene_target: the pose, (4, 4).
        covariance: of its position and rotation in scene axes, (6, 6).
        features: in the target's frame, (M, 3), m.
    """
    depth_m, share = pose_depths(
        exposure.T_camera_scene, T_scene_target, covariance, features, exposure.believed_m
    )
    return Depths(depth_m, share)


@njit(cache=True, error_model="numpy")
def pose_depths(
    T_camera_scene: FloatArray,
    T_scene_target: FloatArray,
    covariance: FloatArray,
    P: FloatArray,
    believed_m: FloatArray,
) -> tuple[FloatArray, float]:
    """Return the depths (M,) of features P (M, 3), and their largest relative deviation."""
    depth_m, deviation_m = np.empty(len(P)), np.empty(len(P))
    r, a, row = T_camera_scene[2], np.empty(3), np.empty(6)
    for j in range(len(P)):
        depth_m[j] = r[3]
        for i in range(3):
            a[i] = 0.0
            for k in range(3):
                a[i] += T_scene_target[i, k] * P[j, k]
            depth_m[j] += r[i] * (a[i] + T_scene_target[i, 3])
            row[i] = r[i]
        row[3] = a[1] * r[2] - a[2] * r[1]
        row[4] = a[2] * r[0] - a[0] * r[2]
        row[5] = a[0] * r[1] - a[1] * r[0]
        variance = 0.0
        for i in range(6):
            for k in range(6):
                variance += row[i] * covariance[i, k] * row[k]
        deviation_m[j] = np.sqrt(max(variance, 0.0))
    depth_m, share = in_front(depth_m, believed_m), 0.0
    for j in range(len(P)):
        share = max(share, deviation_m[j] / depth_m[j])
    return depth_m, share
