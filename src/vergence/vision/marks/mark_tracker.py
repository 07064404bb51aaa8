"""Tracks round marks from image to image."""

import numpy as np

from vergence.arrays import FloatArray, ImageArray
from vergence.signals import SearchWindows
from vergence.vision.image import grey_image
from vergence.vision.marks.round import measure_round_marks
from vergence.vision.tracks import Tracks

FIRST_RADIUS_PX = 8.0  # assumed for a mark before it was measured
SLACK_PX = 10.0  # margin of a window around its mark on every side


class MarkTracker:
    """A point tracker for marks; each is predicted by its last motion.

    Args:
        image: the first image, (height, width) grey.
        points_px: approximate positions of the marks, (M, 2), such as mouse clicks.
    """

    def __init__(self, image: ImageArray, points_px: FloatArray) -> None:
        self._points = np.array(points_px, dtype=np.float64)
        self._before = self._points.copy()
        self._radius = np.full(len(self._points), FIRST_RADIUS_PX)
        self.track(image, self._points)
        self._before = self._points.copy()

    @property
    def points_px(self) -> FloatArray:
        """Last positions of the marks, (M, 2)."""
        return self._points.copy()

    @property
    def radius_px(self) -> FloatArray:
        """Radius of a circle with each mark's area, (M,)."""
        return self._radius.copy()

    def track(self, image: ImageArray, predicted_px: FloatArray | None = None) -> Tracks:
        """Measure the marks in a new image.

        Args:
            image: grey, (height, width).
            predicted_px: expected positions, (M, 2); None to continue as between the last two
                images.
        """
        expected = 2 * self._points - self._before if predicted_px is None else predicted_px
        nothing = np.full(len(expected), np.nan)
        grey, reason = grey_image(image)
        if grey is None:
            lost, why = np.zeros(len(expected), dtype=np.bool_), (reason,) * len(expected)
            wide = np.tile(SLACK_PX**2 * np.eye(2), (len(expected), 1, 1))
            return Tracks(np.array(expected), wide, lost, why, nothing, nothing)
        half = np.repeat(1.5 * self._radius[:, None] + SLACK_PX, 2, axis=1)
        seen = measure_round_marks(grey, expected, half)
        found = seen.found[:, None]
        self._before = np.where(found, self._points, self._before)
        self._points = np.where(found, seen.points_px, self._points)
        self._radius = np.where(seen.found, np.sqrt(seen.area_px / np.pi), self._radius)
        return Tracks(
            seen.points_px,
            seen.covariance_px,
            seen.found,
            seen.reasons,
            nothing,
            nothing,
            SearchWindows(np.array(expected), half),
        )
