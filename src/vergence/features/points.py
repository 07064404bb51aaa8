"""Image points as visual features."""

from vergence.arrays import FloatArray
from vergence.features.feature import Feature
from vergence.features.interaction import interaction_matrix_points
from vergence.parts import as_part


@as_part("feature", "points")
class Points(Feature):
    """Image points themselves: s = (x1, y1, x2, y2, …)."""

    def value(self) -> FloatArray:
        """Return the coordinates, (2M,)."""
        return self.points.ravel()

    def interaction(self) -> FloatArray:
        """Return L (2M, 6), see `interaction_matrix_points`."""
        L: FloatArray = interaction_matrix_points(self.points, self.depth_m)
        return L

    def drift(self, flow: FloatArray, step_s: float = 1e-4) -> FloatArray:
        """Return the flow itself, (2M,)."""
        return flow.ravel()
