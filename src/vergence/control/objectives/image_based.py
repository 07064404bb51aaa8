"""Image-based visual servoing as an objective."""

from collections.abc import Callable
from typing import Literal

import numpy as np

from vergence.arrays import FloatArray
from vergence.control.objectives.gain import Gain, gain_at
from vergence.control.objectives.objective import (
    CameraState,
    Quadratic,
    least_squares_kernel,
    state_of,
)
from vergence.features import Feature, Points, interaction_matrix_points
from vergence.parts import knob, part, slot

InteractionModel = Literal["current", "desired", "mean"]


@part("objective", "image_based")
class ImageBased:
    """Lets the error of a feature decay exponentially: L v = -λ (s - s_star) + ∂s_star/∂t - ∂s/∂t.

    L is evaluated at the present feature, at the desired one, or as the mean of both
    [Chaumette2006] section 5. Only the mean brings a camera through half a turn about its axis.
    Points are weighted by their measurement accuracy; other features use all points equally.
    """

    gain: Gain = knob(1.0, "1/s")  # λ; a number, or a table of near, far and slope
    interaction: InteractionModel = knob("mean")  # where L is evaluated
    # Feature computed from the image points.
    feature: type[Feature] = slot("feature", Points, by_class=True)
    # Damping of the twist, for directions that the features do not determine.
    damping: float = knob(1e-6, above=0, upto=1, live=False)

    def quadratic(self, state: CameraState) -> Quadratic:
        """Return the quadratic for this tick."""
        desired = state.desired_points
        assert desired is not None
        desired_depth = state.depth_m if state.desired_depth_m is None else state.desired_depth_m
        if self.feature is Points:
            error = state.points - desired
            gain = gain_at(self.gain, error)
            change = -gain * error - state.flow
            if state.desired_velocity is not None:
                change = change + state.desired_velocity
            L = self._interaction(
                lambda: interaction_matrix_points(state.points, state.depth_m),
                lambda: interaction_matrix_points(desired, desired_depth),
            )
            rows = change.ravel()
            if state.weights is not None:
                rows = (state.weights @ change[:, :, None]).ravel()
                L = (state.weights @ L.reshape(-1, 2, 6)).reshape(-1, 6)
        else:
            now = self.feature(state.points, state.depth_m)
            goal = self.feature(desired, desired_depth)
            error = now.error(goal)
            gain = gain_at(self.gain, error)
            rows = -gain * error - now.drift(state.flow)
            if state.desired_velocity is not None:
                rows = rows + goal.drift(state.desired_velocity)
            L = np.ascontiguousarray(
                self._interaction(now.interaction, goal.interaction), dtype=np.float64
            )
        damping = np.full(6, self.damping)
        result: Quadratic = least_squares_kernel(L, rows, np.ones(len(L)), damping)
        if self.feature is Points:
            return result._replace(variance=gain**2 * state.variance)
        return result

    def twist(self, features: Points, desired: Points) -> FloatArray:
        """Return v_camera (6,) of this objective alone, for a stationary target.

        Args:
            features: the present ones.
            desired: the desired ones.
        """
        quadratic = self.quadratic(state_of(features, desired))
        v_camera: FloatArray = np.linalg.solve(quadratic.H, quadratic.g).astype(np.float64)
        return v_camera

    def _interaction(
        self, now: Callable[[], FloatArray], desired: Callable[[], FloatArray]
    ) -> FloatArray:
        if self.interaction == "current":
            L: FloatArray = now()
        elif self.interaction == "desired":
            L = desired()
        else:
            L = 0.5 * (now() + desired())
        return L
