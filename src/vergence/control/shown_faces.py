"""The faces of a target that a camera sees, now and at its goal."""

import numpy as np
from numba import njit

from vergence.arrays import BoolArray, FloatArray
from vergence.control.aligned import FEWEST_TURNED, aligned
from vergence.estimation.feature_faces import faces_in_view
from vergence.geometry import se3_inverse


@njit(cache=True, error_model="numpy")
def shown_faces(
    features: FloatArray, now: FloatArray, goal: FloatArray, planes: FloatArray, holds: BoolArray
) -> FloatArray:
    """Return the faces that show features both now and at the goal, in the camera frame, (F, 6).

    Args:
        features: in the target's frame, (M, 3), m; fewer than three show no face.
        now: their positions in the camera frame, (M, 3), m.
        goal: the same at the goal, or (0, 3) if unknown.
        planes: of `FeatureFaces`.
        holds: of `FeatureFaces`, of these features, (M, F).
    """
    if len(features) < FEWEST_TURNED:
        return np.empty((0, 6))
    eyes = np.empty((min(len(goal), 1), 3))
    if len(goal):
        eyes[0] = se3_inverse(aligned(features, goal))[:3, 3]
    shown: FloatArray = faces_in_view(aligned(features, now), planes, holds, eyes)
    return shown
