"""Segments of straight lines."""

import numpy as np

from vergence.arrays import FloatArray
from vergence.features._angles import wrapped
from vergence.features._pairs import ends
from vergence.features.feature import Feature
from vergence.parts import as_part


@as_part("feature", "segments")
class Segments(Feature):
    """Middle, length and direction of segments: s = (x, y, l, α, …) [Chaumette1990].

    Points are taken in pairs: the ends of the first segment, of the second, and so on.
    """

    def value(self) -> FloatArray:
        """Return x, y, l and α (rad) of each segment in turn, (2M,)."""
        first, second = ends("segments", self.points)
        way = second - first
        direction = np.arctan2(way[:, 1], way[:, 0])
        length = np.linalg.norm(way, axis=1)
        return np.column_stack(((first + second) / 2, length, direction)).ravel()

    def interaction(self) -> FloatArray:
        """Return L (2M, 6) of [Chaumette1990], from the motion of the two ends of each segment."""
        first, second = ends("segments", self.points)
        rows = self.flows().reshape(-1, 2, 2, 6)  # segment, end, coordinate
        length = np.linalg.norm(second - first, axis=1)[:, None]
        c, s = np.split((second - first) / length, 2, axis=1)
        across, down = np.moveaxis(rows[:, 1] - rows[:, 0], 1, 0)
        longer, turned = c * across + s * down, (c * down - s * across) / length
        middle = rows.mean(axis=1)
        return np.concatenate((middle, longer[:, None], turned[:, None]), axis=1).reshape(-1, 6)

    def error(self, desired: "Segments") -> FloatArray:
        """Return e = s - s_star, (2M,), with differences of α within half a turn."""
        difference = super().error(desired)
        difference[3::4] = wrapped(difference[3::4])
        return difference
