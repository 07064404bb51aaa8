"""Visual features: what is seen, and how it moves when the camera does."""

from vergence.features.observation import ImagePoints, Observation, SearchWindows, TargetState
from vergence.features.points import interaction_matrix_points

__all__ = [
    "ImagePoints",
    "Observation",
    "SearchWindows",
    "TargetState",
    "interaction_matrix_points",
]
