"""Depth from the image itself: the pose of known features, fitted to each image."""

import numpy as np

from vergence.arrays import BoolArray, FloatArray
from vergence.control.aligned import aligned, lifted
from vergence.control.depth.depth import Depths, MeasuredPoints
from vergence.control.depth.from_pose import depths_at
from vergence.errors import InputError
from vergence.estimation.pose_minima import descend, pose_minima
from vergence.estimation.view import View
from vergence.geometry import se3_inverse
from vergence.parts import part

_FEWEST = 4  # features; three have up to four poses
_STEPS = 6  # of Gauss-Newton per image
_UNLIKELY = 16.0  # χ² per degree of freedom, above which the pose is searched for again
_LEAST_PX_SHARE = 1e-4  # of the focal length: smallest deviation of a point, about 0.1 px


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
        self._features = np.ascontiguousarray(features)
        self._pose: FloatArray | None = None  # (4, 4) T_scene_target

    def update(self, exposure: MeasuredPoints) -> Depths:
        """Return the depths at the fitted pose; at the last pose if too few features are found."""
        found = exposure.found
        if found.sum() < _FEWEST:
            return self._at_last(exposure)
        seen = _seen(exposure, self._features, found)
        start = self._pose
        if start is None:
            start = _from_depths(exposure, self._features, found)
        pose, information, square = _fit(start, seen)
        if not square <= _UNLIKELY * (2 * found.sum() - 6 + 1) or self._pose is None:
            minima = [m for m in pose_minima(seen, start) if np.isfinite(m.square)]
            if minima:
                limit = max(2.0 * minima[0].square, 9.0)
                likely = [m for m in minima if m.square <= limit]
                pose, information, square = min(likely, key=lambda m: self._off(exposure, m.pose))
        if not np.isfinite(square):
            return self._at_last(exposure)
        self._pose = pose
        covariance: FloatArray = np.linalg.inv(information + 1e-9 * np.eye(6)).astype(np.float64)
        return depths_at(exposure, pose, covariance, self._features)

    def _off(self, exposure: MeasuredPoints, pose: FloatArray) -> float:
        """Return the relative difference between the depths at a pose (4, 4) and those believed."""
        depth = depths_at(exposure, pose, np.zeros((6, 6)), self._features).depth_m
        return float(np.abs(np.log(depth / exposure.believed_m)).max())

    def _at_last(self, exposure: MeasuredPoints) -> Depths:
        if self._pose is None:
            return Depths(exposure.believed_m)
        return depths_at(exposure, self._pose, np.zeros((6, 6)), self._features)._replace(
            share=float("nan")
        )


def _fit(start: FloatArray, seen: View) -> tuple[FloatArray, FloatArray, float]:
    fitted: tuple[FloatArray, FloatArray, float] = descend(
        start, seen.poses, seen.points, seen.measured, seen.covariance, _STEPS
    )
    return fitted


def _seen(exposure: MeasuredPoints, features: FloatArray, found: BoolArray) -> View:
    floor = _LEAST_PX_SHARE**2 * np.eye(2)
    return View(
        "",
        exposure.time,
        exposure.T_camera_scene,
        np.flatnonzero(found),
        np.ascontiguousarray(features[found]),
        np.ascontiguousarray(exposure.points[found]),
        np.ascontiguousarray(exposure.covariance[found] + floor),
    )


def _from_depths(exposure: MeasuredPoints, features: FloatArray, found: BoolArray) -> FloatArray:
    """Return the pose (4, 4) in the scene that best aligns features with the believed depths."""
    seen = lifted(exposure.points[found], exposure.believed_m[found])
    pose: FloatArray = se3_inverse(exposure.T_camera_scene) @ aligned(features[found], seen)
    return np.ascontiguousarray(pose)


def fixes_pose(features: FloatArray) -> bool:
    """Return whether the image of features (M, 3) determines the pose: four or more, not a line."""
    if len(features) < _FEWEST:
        return False
    extent = np.linalg.svd(features - features.mean(axis=0), compute_uv=False)
    return bool(extent[1] > 1e-3 * extent[0])
