"""The depth of a target along the optical axis."""

import numpy as np

from vergence.arrays import FloatArray
from vergence.features.feature import Feature
from vergence.features.interaction import depth_interaction
from vergence.parts import as_part


@as_part("feature", "log_depth")
class LogDepth(Feature):
    """Logarithm of the points' mean depth: s - s_star = ln(Z / Z_star) [Malis1999].

    Combined with an image point and the rotation it gives the law of [Malis1999], "2½D".
    """

    def value(self) -> FloatArray:
        """Return s, (1,)."""
        return np.log([self.depth_m.mean()])

    def interaction(self) -> FloatArray:
        """Return L (1, 6), the mean interaction matrix of the depths divided by the mean depth."""
        rows = depth_interaction(self.points, self.depth_m)
        L: FloatArray = rows.mean(axis=0, keepdims=True) / self.depth_m.mean()
        return L
