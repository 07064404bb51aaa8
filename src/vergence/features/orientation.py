"""The orientation of a set of points in the image."""

import numpy as np

from vergence.arrays import FloatArray
from vergence.features._angles import wrapped
from vergence.features._moment_rates import orientation_rate, rates_of_points
from vergence.features._moments import moments_of_points, orientation
from vergence.features.feature import Feature
from vergence.parts import as_part


@as_part("feature", "orientation")
class Orientation(Feature):
    """Direction α of the longest extent, known up to half a turn [Chaumette2004]."""

    def value(self) -> FloatArray:
        """Return α, (1,), rad."""
        return np.array([orientation("orientation", moments_of_points("", self.points).mu)])

    def interaction(self) -> FloatArray:
        """Return L (1, 6), by the chain rule from those of the points."""
        moments = moments_of_points("", self.points)
        orientation("orientation", moments.mu)  # refuses extents that are alike
        rates = rates_of_points(self.points, self.flows(), moments)
        return orientation_rate(moments.mu, rates.mu)[None]

    def error(self, desired: "Orientation") -> FloatArray:
        """Return e = s - s_star, (1,), within a quarter turn."""
        return wrapped(super().error(desired), np.pi)
