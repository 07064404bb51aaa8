"""Image points on the unit sphere."""

import numpy as np

from vergence.arrays import FloatArray
from vergence.features.feature import Feature
from vergence.features.interaction import skew_matrices
from vergence.parts import as_part


@as_part("feature", "spherical_points")
class SphericalPoints(Feature):
    """Directions of the lines of sight, as unit vectors: s = (u1, u2, …).

    Under a camera rotation they all rotate in the same way, wherever they are in the image.
    """

    def value(self) -> FloatArray:
        """Return the unit vectors, (3M,)."""
        rays = np.column_stack((self.points, np.ones(len(self.points))))
        unit: FloatArray = (rays / np.linalg.norm(rays, axis=1, keepdims=True)).ravel()
        return unit

    def interaction(self) -> FloatArray:
        """Return L (3M, 6) by u̇ = -(I - u uᵀ) v / r - ω × u, with r the distance to each point."""
        u = self.value().reshape(-1, 3)
        distance = self.depth_m / u[:, 2]
        across = np.eye(3) - u[:, :, None] * u[:, None]
        rows = np.concatenate((-across / distance[:, None, None], skew_matrices(u)), axis=2)
        return rows.reshape(-1, 6)
