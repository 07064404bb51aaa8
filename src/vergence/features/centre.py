"""The centroid of a set of points."""

from vergence.arrays import FloatArray
from vergence.features.feature import Feature
from vergence.parts import as_part


@as_part("feature", "centre")
class Centre(Feature):
    """Centroid of the points: s = (x_g, y_g)."""

    def value(self) -> FloatArray:
        """Return s, (2,)."""
        centre: FloatArray = self.points.mean(axis=0)
        return centre

    def interaction(self) -> FloatArray:
        """Return L (2, 6), the mean of the interaction matrices of the points."""
        L: FloatArray = self.flows().mean(axis=0)
        return L
