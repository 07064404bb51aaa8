"""Corners of a target as exact projections into a simulated camera, measured in windows."""

import numpy as np

from vergence.arrays import FloatArray, IntArray
from vergence.signals import Frame, ImagePoints
from vergence.simulation.exact_points import no_truth


class ExactCorners:
    """Measures corners as a simulated camera truly projects them, plus noise.

    A point outside its window is not found, as in an image.

    Args:
        noise_px: standard deviation of the noise on each coordinate.
        rng: generator of the noise.
        target: name of the target that has the corners; the task's if None.
    """

    def __init__(
        self, noise_px: float, rng: np.random.Generator, target: str | None = None
    ) -> None:
        self._noise_px, self._rng, self._target = noise_px, rng, target

    def __call__(
        self,
        frame: Frame,
        features: IntArray,
        points_px: FloatArray,
        half_px: FloatArray,
        T_camera_target: FloatArray,
    ) -> ImagePoints:
        """Return the points asked for; see `vergence.estimation.Measure`."""
        truth, count = frame.truth, len(features)
        if truth is None:
            raise no_truth(frame.camera)
        if self._target is not None:
            truth = truth.others.get(self._target, truth)
        measured = truth.points_px[features] + self._rng.normal(0.0, self._noise_px, (count, 2))
        visible = truth.visible[features]
        found = visible & (np.abs(measured - points_px) <= half_px).all(axis=1)
        reasons = tuple(
            "" if ok else "outside its window" if seen else "not in sight"
            for ok, seen in zip(found, visible, strict=True)
        )
        covariance = np.tile(np.eye(2) * self._noise_px**2, (count, 1, 1))
        places = np.where(found[:, None], measured, points_px)
        return ImagePoints(frame.camera, frame.time, places, covariance, found, reasons)
