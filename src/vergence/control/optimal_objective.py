"""The tracking objective of [Nelson1995] for the constrained law."""

from collections.abc import Sequence

import numpy as np
from numba import njit

from vergence.arrays import BoolArray, FloatArray
from vergence.camera import Camera
from vergence.control.image_motion import FeatureState
from vergence.control.objective import TwistObjective, least_squares_objective
from vergence.control.optimal_tracking import AXES, axis_mask, weights_of
from vergence.control.tracking_kernels import SHARING
from vergence.features import interaction_matrix_points
from vergence.robot.positive_definite import factor_spd, solve_factored, times_six
from vergence.signals import Reference

_UNUSED_AXIS = 1e6  # times R: an axis outside `axes` costs too much to move


class OptimalTracking:
    """[Nelson1995] eq. (16): (x - x_D)ᵀ Q (x - x_D) + uᵀ R u at the next picture.

    Departs from the paper in that the target's motion is no unknown disturbance: R charges only for
    what u adds to the displacement that goes along with the target, so none of that is saved.

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
        given = np.broadcast_to(weights_of(Q, R, axes), (len(axes),))
        used = axis_mask(axes, "axes")
        weights = np.full(6, _UNUSED_AXIS * given.max())
        weights[used] = [given[list(axes).index(axis)] for axis in AXES if axis in axes]
        self._R = weights * period**2
        self._sharing = np.where(used, SHARING * self._R, self._R)

    def twist_objective(
        self, features: FeatureState, found: BoolArray, depth: FloatArray, reference: Reference
    ) -> TwistObjective:
        """Return the quadratic for this tick."""
        assert reference.points_px is not None
        desired = self._camera.normalize(reference.points_px)
        T = self._period
        scale = np.tile(self._camera.focal_px, len(desired))
        B = T * scale[:, None] * interaction_matrix_points(features.points, depth)
        wanted = -(features.points - desired).ravel() * scale
        drift = T * features.flow.ravel() * scale
        weight = self._Q * np.repeat(found, 2).astype(np.float64)
        objective: TwistObjective = tracking_objective(
            B, wanted, drift, weight, self._R, self._sharing
        )
        return objective


@njit(cache=True, error_model="numpy")
def tracking_objective(
    B: FloatArray,
    wanted: FloatArray,
    drift: FloatArray,
    weight: FloatArray,
    R: FloatArray,
    sharing: FloatArray,
) -> TwistObjective:
    """Return the quadratic of ‖B v' - wanted‖² + v'ᵀ R v' with v' what v adds to going along.

    Going along with the target is the v that minimises ‖B v + drift‖² and, little, vᵀ R v.

    Args:
        B: (2M, 6).
        wanted: motion of the features, (2M,).
        drift: their motion by the target's own, (2M,).
        weight: of each row, (2M,).
        R: (6,).
        sharing: R where it only shares the motion among the axes, (6,).
    """
    H, g = least_squares_objective(B, wanted, weight, R)
    A, along = least_squares_objective(B, -drift, weight, sharing)
    factor_spd(A)
    solve_factored(A, along)
    return TwistObjective(H, g + times_six(H, along))
