"""Visual features: what is seen, and how it moves when the camera does."""

from vergence.features.feature import Feature
from vergence.features.points import Points, interaction_matrix_points

__all__ = ["Feature", "Points", "interaction_matrix_points"]
