"""Visual features: what is seen, and how it moves when the camera does."""

from vergence.features.points import interaction_matrix_points

__all__ = [
    "interaction_matrix_points",
]
