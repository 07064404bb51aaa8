"""How the corners of a target are measured: in images, or from what a simulated camera knows."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from vergence.arrays import FloatArray, IntArray
from vergence.camera import Camera
from vergence.estimation import Measure
from vergence.signals import Frame, ImagePoints

if TYPE_CHECKING:
    from vergence.vision.known_object import ObjectModel


class CornerWindows:
    """Measures corners in windows of rendered or real images.

    Args:
        model: the target's geometry; feature j is its corner j.
        cameras: by name.
        systematic_px: standard deviation of what the scatter along an edge does not show, such as
            steps of unsmoothed edges and light from the next face; added to what it shows.
    """

    def __init__(
        self, model: "ObjectModel", cameras: Mapping[str, Camera], systematic_px: float = 0.25
    ) -> None:
        from vergence.vision.known_object import CornerExtractor

        self._extractor = CornerExtractor(model)
        self._cameras = cameras
        self._systematic = np.eye(2) * systematic_px**2

    def __call__(
        self,
        frame: Frame,
        features: IntArray,
        points_px: FloatArray,
        half_px: FloatArray,
        T_camera_target: FloatArray,
    ) -> ImagePoints:
        """Return the points asked for; see `vergence.estimation.Measure`."""
        assert frame.image is not None
        if not len(features):
            return _no_points(frame)
        found = self._extractor.measure(
            frame.image, self._cameras[frame.camera], T_camera_target, features, half_px
        )
        covariance = found.covariance_px + self._systematic
        return ImagePoints(
            frame.camera, frame.time, found.points_px, covariance, found.found, found.reasons
        )


def with_outliers(measure: Measure, share: float, rng: np.random.Generator) -> Measure:
    """Return a measure that puts a share of the points it finds anywhere in their windows."""

    def mistaken(
        frame: Frame,
        features: IntArray,
        points_px: FloatArray,
        half_px: FloatArray,
        T_camera_target: FloatArray,
    ) -> ImagePoints:
        seen = measure(frame, features, points_px, half_px, T_camera_target)
        wrong = rng.random(len(features)) < share
        anywhere = points_px + rng.uniform(-1.0, 1.0, points_px.shape) * half_px
        places = np.where((wrong & seen.found)[:, None], anywhere, seen.points_px)
        return seen._replace(points_px=places)

    return mistaken


def with_noise(measure: Measure, noise_px: float) -> Measure:
    """Return a measure whose points all claim the same noise, as R of [Lippiello2005] has it."""

    def claimed(
        frame: Frame,
        features: IntArray,
        points_px: FloatArray,
        half_px: FloatArray,
        T_camera_target: FloatArray,
    ) -> ImagePoints:
        seen = measure(frame, features, points_px, half_px, T_camera_target)
        covariance = np.tile(np.eye(2) * noise_px**2, (len(features), 1, 1))
        return seen._replace(covariance_px=covariance)

    return claimed


_NO_POINTS = np.empty((0, 2))
_NO_COVARIANCE = np.empty((0, 2, 2))
_NONE = np.zeros(0, dtype=np.bool_)


def _no_points(frame: Frame) -> ImagePoints:
    return ImagePoints(frame.camera, frame.time, _NO_POINTS, _NO_COVARIANCE, _NONE, ())
