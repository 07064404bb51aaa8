"""The size of a set of points in the image."""

import numpy as np

from vergence.arrays import FloatArray
from vergence.features._moment_rates import rates_of_points
from vergence.features._moments import moments_of_points, require_same_points
from vergence.features.feature import Feature
from vergence.parts import as_part


@as_part("feature", "size")
class Size(Feature):
    """s = 1/√a, with a the sum of squared distances from the centre: proportional to the distance.

    [Tahri2005]; for a target that faces the camera, it suffices to control the distance.
    """

    def value(self) -> FloatArray:
        """Return s, (1,)."""
        return np.array([moments_of_points("size", self.points).size ** -0.5])

    def error(self, desired: "Size") -> FloatArray:
        """Return e = s - s_star, (1,)."""
        require_same_points("size", self.points, desired.points)
        return super().error(desired)

    def interaction(self) -> FloatArray:
        """Return L (1, 6), by the chain rule from those of the points."""
        moments = moments_of_points("size", self.points)
        rates = rates_of_points(self.points, self.flows(), moments)
        L: FloatArray = -0.5 * moments.size**-1.5 * rates.size[None]
        return L
