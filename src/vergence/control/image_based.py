"""Image-based visual servoing as an objective."""

from typing import Literal

import numpy as np

from vergence.arrays import BoolArray, FloatArray
from vergence.camera import Camera
from vergence.control.image_motion import FeatureState
from vergence.control.objective import TwistObjective, least_squares_objective
from vergence.errors import InputError
from vergence.features import interaction_matrix_points
from vergence.signals import Reference

InteractionModel = Literal["current", "desired", "mean"]


class ImageBased:
    """Lets the features' error decay exponentially: L v = -λ (s - s*) + ∂s*/∂t - flow.

    Args:
        camera: intrinsics.
        gain: λ, 1/s.
        model: where L is taken: at the features as they are, as they should be, or the mean.
        damping: on the twist, so that few features leave no direction open.
        goal_depth_m: depth of the features where they should be, (M,), for L there; as deep as they
            are now if None.
    """

    def __init__(
        self,
        camera: Camera,
        gain: float = 1.0,
        model: InteractionModel = "current",
        damping: float = 1e-6,
        goal_depth_m: FloatArray | None = None,
    ) -> None:
        if not gain > 0:
            raise InputError("law", "gain", gain, "a number above zero")
        self._camera, self._gain, self._model = camera, gain, model
        self._R = np.full(6, damping)
        self._goal_depth_m = goal_depth_m

    def twist_objective(
        self, features: FeatureState, found: BoolArray, depth: FloatArray, reference: Reference
    ) -> TwistObjective:
        """Return the quadratic for this tick."""
        assert reference.points_px is not None
        desired = self._camera.normalize(reference.points_px)
        wanted = -self._gain * (features.points - desired) - features.flow
        if reference.velocity_px is not None:
            wanted = wanted + self._camera.normalize_velocity(reference.velocity_px, desired)
        L = self._interaction(features.points, desired, depth)
        objective: TwistObjective = least_squares_objective(
            L, wanted.ravel(), np.repeat(found, 2).astype(np.float64), self._R
        )
        return objective

    def _interaction(
        self, points: FloatArray, desired: FloatArray, depth: FloatArray
    ) -> FloatArray:
        there = depth if self._goal_depth_m is None else self._goal_depth_m
        if self._model == "current":
            L: FloatArray = interaction_matrix_points(points, depth)
        elif self._model == "desired":
            L = interaction_matrix_points(desired, there)
        else:
            L = 0.5 * (
                interaction_matrix_points(points, depth) + interaction_matrix_points(desired, there)
            )
        return L
