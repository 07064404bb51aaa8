"""Plain feature tracking: the inner circle with the last position as prediction."""

from vergence.signals import Frame, ImagePoints, Observation
from vergence.vision import PointTracker


class TrackedPoints:
    """Observes the points that a tracker follows in one camera's pictures.

    Args:
        camera: the camera's name; other cameras' frames are passed over.
        tracker: has been shown the points already.
    """

    def __init__(self, camera: str, tracker: PointTracker) -> None:
        self._camera = camera
        self._tracker = tracker

    def observe(self, frames: tuple[Frame, ...]) -> Observation | None:
        """Return the points in the frames that arrived, or None if none did."""
        views = tuple(self._view(frame) for frame in frames if frame.camera == self._camera)
        return Observation(views[-1].time, views) if views else None

    def _view(self, frame: Frame) -> ImagePoints:
        assert frame.image is not None
        tracks = self._tracker.track(frame.image)
        return ImagePoints(
            frame.camera,
            frame.time,
            tracks.points_px,
            tracks.covariance_px,
            tracks.found,
            tracks.reasons,
            tracks.windows,
        )
