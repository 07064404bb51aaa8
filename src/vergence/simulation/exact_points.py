"""Perception without images: true projections, optionally with noise."""

import numpy as np

from vergence.arrays import FloatArray
from vergence.errors import InputError
from vergence.signals import Frame, ImagePoints, Observation

_LEAST_PX = 1e-3
OUT_OF_SIGHT = "out of sight"


class ExactPoints:
    """Observes the target's features as a simulated camera truly projects them.

    Args:
        camera: the camera's name; frames of other cameras are ignored.
        noise_px: standard deviation of the noise on each coordinate.
        rng: generator of the noise.
    """

    def __init__(
        self, camera: str, noise_px: float = 0.0, rng: np.random.Generator | None = None
    ) -> None:
        self._camera = camera
        self._noise_px = noise_px
        self._rng = rng or np.random.default_rng(0)

    def observe(self, frames: tuple[Frame, ...]) -> Observation | None:
        """Return the points in the frames that arrived, or None if none did."""
        views = tuple(self._view(frame) for frame in frames if frame.camera == self._camera)
        return Observation(views[-1].time, views) if views else None

    def _view(self, frame: Frame) -> ImagePoints:
        truth = frame.truth
        if truth is None:
            raise no_truth(frame.camera)
        noise = self._rng.normal(0.0, 1.0, truth.points_px.shape) * self._noise_px
        covariance = covariance_px(self._noise_px)
        return ImagePoints(
            frame.camera,
            frame.time,
            np.where(truth.visible[:, None], truth.points_px + noise, np.nan),
            np.broadcast_to(covariance, (len(noise), 2, 2)),
            truth.visible,
            tuple("" if seen else OUT_OF_SIGHT for seen in truth.visible),
            depth_m=truth.depth_m,
            depth_deviation_m=np.zeros(len(noise)),
        )


def covariance_px(noise_px: float) -> FloatArray:
    """Return the covariance of a point, (2, 2), px²; without noise, too, it is not zero."""
    return np.eye(2) * max(noise_px, _LEAST_PX) ** 2


def no_truth(camera: str) -> InputError:
    """Return the error of a camera that is not simulated, so has no exact projections."""
    return InputError(f"camera {camera}", "", "frames without truth", "images, or a simulation")
