"""Plain feature tracking: the predict-measure loop with the last position as prediction."""

from typing import Protocol

import numpy as np

from vergence.arrays import BoolArray, FloatArray, ImageArray, as_floats
from vergence.errors import InputError, ShapeError
from vergence.signals import Frame, ImagePoints, Observation, SearchWindows


class MeasuredPoints(Protocol):
    """The measurement of points in one image."""

    @property
    def points_px(self) -> FloatArray:
        """Their positions, (M, 2); the expected one where a point was not found."""
        ...

    @property
    def covariance_px(self) -> FloatArray:
        """Covariances of the positions, (M, 2, 2) px²."""
        ...

    @property
    def found(self) -> BoolArray:
        """Which points were found, (M,)."""
        ...

    @property
    def reasons(self) -> tuple[str, ...]:
        """Reasons why points were not found, (M,); empty where found."""
        ...

    @property
    def windows(self) -> SearchWindows | None:
        """The windows in which they were searched for."""
        ...


class TracksPoints(Protocol):
    """Measures the same points in successive images."""

    def track(self, image: ImageArray) -> MeasuredPoints:
        """Measure the points in a new image, (height, width) grey."""
        ...


class TrackedPoints:
    """Observes the points that a tracker tracks in one camera's images.

    Args:
        camera: the camera's name; frames of other cameras are ignored.
        tracker: has been initialised with the points.
        count: number of points; that of the tracker if None.
    """

    def __init__(self, camera: str, tracker: TracksPoints, count: int | None = None) -> None:
        self._camera = camera
        self._tracker = tracker
        self._count = count

    def observe(self, frames: tuple[Frame, ...]) -> Observation | None:
        """Return the points in the frames that arrived, or None if none did.

        Raises:
            ShapeError: if the tracker measures more or fewer points.
            InputError: if it reports a point as found without a finite position.
        """
        views = tuple(self._view(frame) for frame in frames if frame.camera == self._camera)
        return Observation(views[-1].time, views) if views else None

    def _view(self, frame: Frame) -> ImagePoints:
        assert frame.image is not None
        tracks = self._tracker.track(frame.image)
        points_px = as_floats(tracks.points_px, (self._count, 2), "points_px of the tracker")
        count = len(points_px)
        covariance_px = as_floats(tracks.covariance_px, (count, 2, 2), "covariance_px")
        found = np.asarray(tracks.found, dtype=np.bool_)
        if len(found) != count or len(tracks.reasons) != count:
            raise ShapeError("found and reasons of the tracker", found.shape, (count,))
        if not (np.isfinite(points_px[found]).all() and np.isfinite(covariance_px[found]).all()):
            raise InputError("tracker", "points_px", "found, but not finite", "finite positions")
        return ImagePoints(
            frame.camera,
            frame.time,
            points_px,
            covariance_px,
            found,
            tracks.reasons,
            tracks.windows,
            getattr(tracks, "joined", None),
        )
