"""The tracking objective of [Nelson1995] for the constrained law."""

from collections.abc import Sequence

import numpy as np

from vergence.arrays import BoolArray, FloatArray
from vergence.camera import Camera
from vergence.control.image_motion import FeatureState
from vergence.control.objective import TwistObjective, least_squares_objective
from vergence.control.optimal_tracking import AXES, axis_mask
from vergence.features import interaction_matrix_points
from vergence.planning import Reference

_UNUSED_AXIS = 1e6  # times R: an axis outside `axes` costs too much to move


class OptimalTracking:
    """[Nelson1995] eq. (16): (x - x_D)ᵀ Q (x - x_D) + uᵀ R u at the next picture.

    Departs from the paper in that the target's motion is no unknown disturbance: the flow carries
    the features on to the next picture.

    Args:
        camera: intrinsics.
        axes: controlled axes of the camera.
        Q: weight on the errors, 1/px².
        R: weight on the displacement a frame, one number or one for each of `axes`.
        period: time between pictures, s.
    """

    def __init__(
        self,
        camera: Camera,
        axes: Sequence[str] = AXES,
        Q: float = 2e-6,
        R: float | Sequence[float] = 10.0,
        period: float = 1 / 30,
    ) -> None:
        self._camera, self._Q, self._period = camera, Q, period
        given = np.broadcast_to(np.asarray(R, dtype=np.float64), (len(axes),))
        weights = np.full(6, _UNUSED_AXIS * given.max())
        weights[np.flatnonzero(axis_mask(axes, "axes"))] = [
            given[list(axes).index(axis)] for axis in AXES if axis in axes
        ]
        self._R = weights * period**2

    def twist_objective(
        self, features: FeatureState, found: BoolArray, depth: FloatArray, reference: Reference
    ) -> TwistObjective:
        """Return the quadratic for this tick."""
        assert reference.points_px is not None
        desired = self._camera.normalize(reference.points_px)
        T = self._period
        scale = np.tile(self._camera.focal_px, len(desired))
        wanted = -(features.points - desired + T * features.flow).ravel() * scale
        B = T * scale[:, None] * interaction_matrix_points(features.points, depth)
        weight = self._Q * np.repeat(found, 2).astype(np.float64)
        objective: TwistObjective = least_squares_objective(B, wanted, weight, self._R)
        return objective
