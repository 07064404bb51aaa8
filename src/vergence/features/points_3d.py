"""Points in space, in the camera frame."""

import numpy as np

from vergence.arrays import FloatArray
from vergence.features.feature import Feature
from vergence.features.interaction import skew_matrices
from vergence.parts import as_part


@as_part("feature", "points_3d")
class Points3d(Feature):
    """Positions of the points in the camera frame, metres: s = (X1, Y1, Z1, X2, …).

    They are as accurate as the depths. The target moves in a straight line in space.
    """

    def value(self) -> FloatArray:
        """Return the positions, (3M,), m."""
        rays = np.column_stack((self.points, np.ones(len(self.points))))
        positions: FloatArray = (rays * self.depth_m[:, None]).ravel()
        return positions

    def interaction(self) -> FloatArray:
        """Return L (3M, 6) by Ẋ = -v - ω × X."""
        X = self.value().reshape(-1, 3)
        moved = np.tile(-np.eye(3), (len(X), 1, 1))
        return np.concatenate((moved, skew_matrices(X)), axis=2).reshape(-1, 6)
