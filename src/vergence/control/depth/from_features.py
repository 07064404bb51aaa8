"""Depth from the image itself: the pose of known features, fitted to each image."""

import numpy as np
from numba import njit

from vergence.arrays import BoolArray, FloatArray
from vergence.control.aligned import aligned, fixes_orientation, lifted
from vergence.control.depth.depth import Depths, MeasuredPoints
from vergence.control.depth.from_pose import pose_depths
from vergence.errors import InputError
from vergence.estimation.pose_minima import descend, local_minima, spread_rotations
from vergence.geometry import se3_compose, se3_inverse
from vergence.parts import part

_FEWEST = 4  # features; three have up to four poses
_STEPS = 6  # of Gauss-Newton per image
_UNLIKELY = 16.0  # χ² per degree of freedom, above which the pose is searched for again
_LEAST_PX_SHARE = 1e-4  # of the focal length: smallest deviation of a point, about 0.1 px
_LIKELY, _AS_GOOD = 9.0, 2.0  # χ², and factor of the least χ², up to which a pose is considered


@part("depth", "from_features")
class DepthFromFeatures:
    """The depth of known features at the pose that fits the newest image best.

    The fit starts from the last pose and takes a few steps; no assumption is made about the
    target's motion. If several poses fit the first image, the one closest to the believed depth is
    used.
    """

    @property
    def estimates_motion(self) -> bool:
        """True: every image is fitted independently."""
        return True

    def bind(self, features: FloatArray | None) -> "FeatureSource":
        """Return a source for one camera.

        Raises:
            InputError: if fewer than four features are known.
        """
        if features is None or len(features) < _FEWEST:
            given = f"from_features with {0 if features is None else len(features)} known features"
            raise InputError("law", "depth", given, "four or more in target.features")
        return FeatureSource(features)


class FeatureSource:
    """Fits the pose of known features to each image.

    Args:
        features: in the target's frame, (M, 3), m.
    """

    def __init__(self, features: FloatArray) -> None:
        self._features = np.array(features)
        self._pose = NO_POSE

    def update(self, exposure: MeasuredPoints) -> Depths:
        """Return the depths at the fitted pose; at the last pose if too few features are found."""
        self._pose, depth_m, share = fitted_depths(
            self._pose,
            exposure.T_camera_scene,
            exposure.points,
            exposure.found,
            exposure.covariance,
            exposure.believed_m,
            self._features,
            spread_rotations(),
        )
        return Depths(depth_m, share)


NO_POSE = np.full((4, 4), np.nan)  # before the first fit


@njit(cache=True, error_model="numpy")
def fitted_depths(
    last: FloatArray,
    T_camera_scene: FloatArray,
    points: FloatArray,
    found: BoolArray,
    covariance: FloatArray,
    believed_m: FloatArray,
    features: FloatArray,
    rotations: FloatArray,
) -> tuple[FloatArray, FloatArray, float]:
    """Fit the pose of known features to an image.

    Args:
        last: T_scene_target (4, 4) that was fitted last, or `NO_POSE`.
        T_camera_scene: at the exposure, (4, 4).
        points: normalized coordinates, (M, 2).
        found: (M,).
        covariance: of the points, (M, 2, 2).
        believed_m: depth at the start, (M,).
        features: in the target's frame, (M, 3), m.
        rotations: from `spread_rotations`.

    Returns:
        The pose (4, 4), the depths of the features (M,), and their largest relative deviation, NaN
        if unknown.
    """
    known = not np.isnan(last[0, 0])
    count = int(np.sum(found))
    if count >= _FEWEST:
        poses, spread = np.empty((count, 4, 4)), covariance[found]
        for j in range(count):
            poses[j] = T_camera_scene
            for a in range(2):
                spread[j, a, a] += _LEAST_PX_SHARE**2
        seen, measured = features[found], points[found]
        start = last
        if not known:
            T_camera_target = aligned(seen, lifted(measured, believed_m[found]))
            start = se3_compose(se3_inverse(T_camera_scene), T_camera_target)
        pose, information, square = descend(start, poses, seen, measured, spread, _STEPS)
        if not (known and square <= _UNLIKELY * (2 * count - 6 + 1)):
            minima = local_minima(start, rotations, poses, seen, measured, spread)
            least, nearest = np.inf, np.inf
            for k in range(len(minima.square)):
                least = min(least, minima.square[k])
            for k in range(len(minima.square)):
                if minima.square[k] <= max(_AS_GOOD * least, _LIKELY):
                    depth_m, _ = pose_depths(
                        T_camera_scene, minima.pose[k], np.zeros((6, 6)), features, believed_m
                    )
                    off = np.max(np.abs(np.log(depth_m / believed_m)))
                    if off < nearest:
                        nearest, pose, square = off, minima.pose[k], minima.square[k]
                        information = minima.information[k]
        if np.isfinite(square):
            deviation = np.linalg.inv(information + 1e-9 * np.eye(6)).astype(np.float64)
            depth_m, share = pose_depths(T_camera_scene, pose, deviation, features, believed_m)
            return pose, depth_m, share
    if not known:
        return last, believed_m, np.nan
    depth_m, _ = pose_depths(T_camera_scene, last, np.zeros((6, 6)), features, believed_m)
    return last, depth_m, np.nan


def fixes_pose(features: FloatArray) -> bool:
    """Return whether the image of features (M, 3) determines the pose: four or more, not a line."""
    return len(features) >= _FEWEST and bool(fixes_orientation(np.array(features)))
