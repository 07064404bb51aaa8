"""Straight lines."""

import numpy as np

from vergence.arrays import FloatArray
from vergence.features._angles import wrapped
from vergence.features._pairs import ends
from vergence.features.feature import Feature
from vergence.parts import as_part


@as_part("feature", "lines")
class Lines(Feature):
    """Lines x cos θ + y sin θ = ρ through pairs of points: s = (ρ1, θ1, …) [Espiau1992].

    θ is the direction of the normal that points to the left of the direction from the first point
    to the second, as seen in the image, so a line differs from itself turned by half a turn.
    """

    def value(self) -> FloatArray:
        """Return ρ and θ (rad) of each line in turn, (M,)."""
        first, second = ends("lines", self.points)
        way = second - first
        normal = np.column_stack((way[:, 1], -way[:, 0]))
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        distance = np.sum(normal * first, axis=1)
        return np.column_stack((distance, np.arctan2(normal[:, 1], normal[:, 0]))).ravel()

    def error(self, desired: "Lines") -> FloatArray:
        """Return e = s - s_star, (M,), with differences of θ within half a turn."""
        difference = super().error(desired)
        difference[1::2] = wrapped(difference[1::2])
        return difference

    def interaction(self) -> FloatArray:
        """Return L (M, 6), from the motion of the two points of each line.

        With n the normal, ℓ the distance between the points and ẋ their motion,
        θ̇ = nᵀ (ẋ1 - ẋ2) / ℓ and ρ̇ = nᵀ ẋ1 + θ̇ mᵀ x1, where m = dn/dθ. For a line in space this
        equals the matrix of [Espiau1992].
        """
        first, second = ends("lines", self.points)
        way = second - first
        length = np.linalg.norm(way, axis=1)[:, None]
        normal = np.column_stack((way[:, 1], -way[:, 0])) / length
        rows = self.flows().reshape(-1, 2, 2, 6)  # line, end, coordinate
        across = np.einsum("lc,lecv->lev", normal, rows)
        turn = (across[:, 0] - across[:, 1]) / length
        along = np.sum(way / length * first, axis=1)[:, None]
        return np.stack((across[:, 0] + turn * along, turn), axis=1).reshape(-1, 6)
