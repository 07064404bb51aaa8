"""Straight lines as a part in a cell file."""

from typing import ClassVar

import numpy as np

from vergence.arrays import FloatArray, ImageArray
from vergence.parts import knob, part
from vergence.vision.curves.line_tracker import LineTracker, lines_through


@part("tracker", "lines")
class LineTracking:
    """Tracks straight edges, each given by two points on it; see `LineTracker`."""

    count: ClassVar[int] = 1  # of the sets of points: lines go by pairs

    # Largest motion of a line between two images.
    reach_px: float = knob(20.0, "px", least=4, upto=200)
    length_px: float = knob(240.0, "px", least=32, upto=1e4)  # length of each line that is searched
    contrast: float = knob(15.0, least=3, upto=255)  # smallest step across a line, in grey levels

    def start(self, image: ImageArray, points_px: FloatArray) -> LineTracker:
        """Return the tracker of the lines through pairs of points.

        Raises:
            InputError: if a line is not found.
        """
        return LineTracker(image, points_px, self.reach_px, self.length_px, self.contrast)

    def points_on(self, points_px: FloatArray, size: tuple[int, int]) -> FloatArray:
        """Return the points that represent the lines through pairs, (2 L, 2).

        Raises:
            InputError: if the points define no lines.
        """
        return np.concatenate([line.points(size) for line in lines_through(points_px, size)])
