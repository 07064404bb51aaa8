"""Plain feature tracking: the predict-measure loop with the last position as prediction."""

from typing import Protocol

from vergence.arrays import BoolArray, FloatArray, ImageArray
from vergence.signals import Frame, ImagePoints, Observation, SearchWindows


class MeasuredPoints(Protocol):
    """Where points are in one image."""

    @property
    def points_px(self) -> FloatArray:
        """Their places, (M, 2); where a point was not found, the expected one."""
        ...

    @property
    def covariance_px(self) -> FloatArray:
        """Of the places, (M, 2, 2) px²."""
        ...

    @property
    def found(self) -> BoolArray:
        """Which were found, (M,)."""
        ...

    @property
    def reasons(self) -> tuple[str, ...]:
        """Why not, (M,); empty where found."""
        ...

    @property
    def windows(self) -> SearchWindows | None:
        """Where they were searched for."""
        ...


class TracksPoints(Protocol):
    """Measures the same points in one image after the other."""

    def track(self, image: ImageArray) -> MeasuredPoints:
        """Measure the points in a new image, (height, width) grey."""
        ...


class TrackedPoints:
    """Observes the points that a tracker follows in one camera's images.

    Args:
        camera: the camera's name; other cameras' frames are passed over.
        tracker: has been shown the points already.
    """

    def __init__(self, camera: str, tracker: TracksPoints) -> None:
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
