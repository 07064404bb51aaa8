"""Image-based visual servoing as an objective."""

from typing import Literal, NamedTuple, get_args

import numpy as np
from numba import njit

from vergence.arrays import FloatArray
from vergence.control.objectives.gain import (
    Gain,
    GainNumbers,
    falling_gain,
    gain_at,
    gain_numbers,
)
from vergence.control.objectives.objective import (
    CameraState,
    Quadratic,
    least_squares,
    least_squares_kernel,
    state_of,
)
from vergence.features import Feature, Points
from vergence.features.compiled_features import (
    COMPILED_FEATURES,
    POINTS,
    feature_drift,
    feature_interaction,
    feature_value,
)
from vergence.part_answers import checked
from vergence.parts import knob, part, slot

InteractionModel = Literal["current", "desired", "mean"]
_CURRENT, _DESIRED, _MEAN = range(len(get_args(InteractionModel)))
_ALL_ONE = np.empty((0, 2, 2))


class PointDecay(NamedTuple):
    """The numbers of the objective for a feature that kernels know."""

    feature: int  # of `COMPILED_FEATURES`
    gain: GainNumbers
    interaction: int  # where L is evaluated: at the present points, the desired ones, or both
    damping: float


@part("objective", "image_based")
class ImageBased:
    """Lets the error of a feature decay exponentially: L v = -λ (s - s_star) + ∂s_star/∂t - ∂s/∂t.

    L is evaluated at the present feature, at the desired one, or as the mean of both
    [Chaumette2006] section 5. Only the mean brings a camera through half a turn about its axis.
    Points are weighted by their measurement accuracy; other features use all points equally.
    """

    # Decay rate λ of the error; in a cell file it may also be { near, far, slope }.
    gain: Gain = knob(1.0, "1/s")
    # Points at which the interaction matrix L is evaluated; mean: that of both.
    interaction: InteractionModel = knob("mean")
    # Feature computed from the image points.
    feature: type[Feature] = slot("feature", Points, by_class=True)
    # Damping of the twist, for directions that the features do not determine.
    damping: float = knob(1e-6, above=0, upto=1, live=False)

    def quadratic(self, state: CameraState) -> Quadratic:
        """Return the quadratic for this tick."""
        desired = state.desired_points
        assert desired is not None
        desired_depth = state.depth_at_goal
        feature = COMPILED_FEATURES.get(self.feature) if len(state.points) else POINTS
        if feature is not None:
            velocity, weights = state.desired_velocity, state.weights
            result: Quadratic = point_quadratic(
                self.numbers(feature),
                state.points,
                state.depth_m,
                desired,
                desired_depth,
                state.flow if velocity is None else state.flow - velocity,
                _ALL_ONE if weights is None or feature != POINTS else weights,
                state.variance,
            )
            return result
        now, goal = self.feature(state.points, state.depth_m), self.feature(desired, desired_depth)
        error = checked(now, "error", now.error(goal), (None,))
        rows = -gain_at(self.gain, error) * error - now.drift(state.flow)
        if state.desired_velocity is not None:
            rows = rows + goal.drift(state.desired_velocity)
        L = checked(now, "interaction", self._interaction(now, goal), (len(error), 6))
        return least_squares(L, rows, damping=self.damping)

    def numbers(self, feature: int) -> PointDecay:
        """Return the objective's numbers, with those of a feature of `COMPILED_FEATURES`."""
        where = get_args(InteractionModel).index(self.interaction)
        return PointDecay(feature, gain_numbers(self.gain), where, self.damping)

    def twist(self, features: Points, desired: Points) -> FloatArray:
        """Return v_camera (6,) of this objective alone, for a stationary target.

        Args:
            features: the present ones.
            desired: the desired ones.
        """
        quadratic = self.quadratic(state_of(features, desired))
        v_camera: FloatArray = np.linalg.solve(quadratic.H, quadratic.g).astype(np.float64)
        return v_camera

    def _interaction(self, now: Feature, desired: Feature) -> FloatArray:
        if self.interaction == "current":
            return now.interaction()
        if self.interaction == "desired":
            return desired.interaction()
        return 0.5 * (now.interaction() + desired.interaction())


@njit(cache=True, error_model="numpy")
def point_quadratic(
    decay: PointDecay,
    points: FloatArray,
    depth_m: FloatArray,
    desired: FloatArray,
    desired_depth_m: FloatArray,
    drift: FloatArray,
    weights: FloatArray,
    variance: float,
) -> Quadratic:
    """Return the quadratic of `ImageBased` for a feature that kernels know.

    Args:
        decay: the objective's numbers.
        points: present ones, normalized coordinates, (M, 2).
        depth_m: of them, (M,).
        desired: s_star, (M, 2).
        desired_depth_m: (M,).
        drift: ∂s/∂t - ∂s_star/∂t, (M, 2), 1/s.
        weights: roots of the weights of each image point, (M, 2, 2); (0, 2, 2) if all are 1.
        variance: of a point's weighted row.
    """
    feature = decay.feature
    error = feature_value(feature, points, depth_m)
    error -= feature_value(feature, desired, desired_depth_m)
    gain = falling_gain(decay.gain, np.max(np.abs(error)) if len(error) else 0.0)
    rows = -gain * error - feature_drift(feature, drift)
    if decay.interaction == _CURRENT:
        L = feature_interaction(feature, points, depth_m)
    else:
        L = feature_interaction(feature, desired, desired_depth_m)
        if decay.interaction == _MEAN:
            L = 0.5 * (feature_interaction(feature, points, depth_m) + L)
    for j in range(len(weights)):
        rows[2 * j : 2 * j + 2] = weights[j] @ rows[2 * j : 2 * j + 2]
        L[2 * j : 2 * j + 2] = weights[j] @ L[2 * j : 2 * j + 2]
    quadratic = least_squares_kernel(L, rows, np.ones(len(L)), np.full(6, decay.damping))
    if feature != POINTS:
        variance = 0.0
    return Quadratic(quadratic.H, quadratic.g, gain * gain * variance)
