"""Optimal tracking with singularity and joint limit avoidance, [Nelson1995]."""

from typing import Annotated, Literal, NamedTuple

import numpy as np
from numba import njit
from pydantic import Field

from vergence.arrays import BoolArray, FloatArray
from vergence.control.objectives._tracking import (
    SHARING,
    TrackingGains,
    image_square,
    tracking_displacement,
)
from vergence.control.objectives.objective import CameraState, Quadratic
from vergence.errors import InputError
from vergence.parts import knob, part
from vergence.robot import Arm
from vergence.robot.manipulability import (
    camera_gradient,
    determinant_slope,
    limit_penalty,
    measure_gradient,
    posture,
)
from vergence.robot.positive_definite import factor_spd, solve_factored, times_six

Axis = Literal["x", "y", "z", "rx", "ry", "rz"]
AXES: tuple[Axis, ...] = ("x", "y", "z", "rx", "ry", "rz")
_UNUSED_AXIS = 1e6  # times R: makes an axis outside `axes` too expensive to move
_LEAST_DET = 1e-9  # of |det J|, by which its slope is divided
_DAMPED_BELOW = 0.02  # smallest singular value of J below which its inverse is damped


class Avoidance(NamedTuple):
    """The distance of the arm from limits and singularities, and the direction away from them."""

    w: float  # w'(q), [Nelson1995] eq. (26), or w(q), eq. (24)
    gradient: FloatArray  # ∂w'/∂x along the camera's axes, (6,)


@part("objective", "optimal_tracking")
class OptimalTracking:
    """Minimises F = (x - x_D)ᵀ Q (x - x_D) + uᵀ R u + S / w'(q), [Nelson1995] eq. (28).

    Penalises feature errors, camera motion and poor configurations of the arm. The paper's two-axis
    and four-axis strategies are choices of `axes`; with three or more features and all six axes it
    keeps the whole pose. With the paper's gains, u is a displacement per image period T.

    Departs from the paper in that the target's motion, if it is fed forward, is not an unknown
    disturbance: R applies only to what u adds to moving along with the target.
    """

    # Camera axes used for tracking.
    axes: Annotated[tuple[Axis, ...], Field(min_length=1)] = knob(AXES)
    # Those of them that are also used for avoidance, along ∇w'.
    avoidance_axes: tuple[Axis, ...] = knob(())
    # Weight of the errors, divided among the features.
    Q: float = knob(2e-6, "1/px²", above=0, upto=1)
    # Weight of the motion, one number for all axes or one for each.
    R: Annotated[float, Field(gt=0, le=1e9)] | tuple[Annotated[float, Field(gt=0, le=1e9)], ...] = (
        knob(10.0, "1/m², 1/rad²")
    )
    # Weight of 1/w', where w' is the penalised manipulability.
    S: float = knob(0.0, "cost × w′", least=0, upto=1e3, needs="avoidance_axes")
    # Penalty for joint limits: [Nelson1995] eq. (27), or per joint.
    penalty: Literal["product", "per_joint"] = knob("product", needs="S")
    # Manipulability: [Nelson1995] eq. (26), or eq. (24) with |det J| in place of its square.
    measure: Literal["squared", "absolute"] = knob("squared", needs="S")
    # Steepness k of the penalty.
    penalty_k: float = knob(1e5, above=0, upto=1e9, needs="S")
    # Highest camera speed for avoidance.
    avoidance_speed_max_m_s: float = knob(0.5, "m/s", above=0, upto=10, needs="S")

    def __post_init__(self) -> None:
        if stray := [axis for axis in self.avoidance_axes if axis not in self.axes]:
            allowed = f"of axes: {', '.join(self.axes)}"
            raise InputError(type(self).__name__, "avoidance_axes", ", ".join(stray), allowed)
        weights = np.size(self.R)
        if np.ndim(self.R) and weights != len(self.axes):
            allowed = f"one, or {len(self.axes)}, one for each of the axes"
            raise InputError(type(self).__name__, "R", f"{weights} weights", allowed)

    @property
    def controlled(self) -> BoolArray:
        """The axes used for tracking, (6,)."""
        return axis_mask(self.axes)

    def gains(self, count: int, period_s: float) -> TrackingGains:
        """Return the weights for a given number of features and time between images."""
        given = np.broadcast_to(np.asarray(self.R, dtype=np.float64), (len(self.axes),))
        R = np.full(6, _UNUSED_AXIS * given.max())
        for axis, weight in zip(self.axes, given, strict=True):
            R[AXES.index(axis)] = weight
        return TrackingGains(
            self.Q / max(count, 1),
            R,
            self.S,
            self.controlled.astype(np.float64),
            axis_mask(self.avoidance_axes).astype(np.float64),
            self.avoidance_speed_max_m_s * period_s,
            period_s,
        )

    def quadratic(self, state: CameraState) -> Quadratic:
        """Return the quadratic for this tick."""
        assert state.desired_points is not None
        gains = self.gains(state.count, state.period_s)
        features = np.column_stack((state.points, state.desired_points, state.depth_m, state.flow))
        away = self._avoidance(state)
        result: Quadratic = tracking_quadratic(
            features, state.camera.focal_px, gains, away.w, away.gradient
        )
        return result

    def _avoidance(self, state: CameraState) -> Avoidance:
        if self.S == 0.0 or state.arm is None or state.q is None:
            return Avoidance(1.0, np.zeros(6))
        arm: Arm = state.arm
        now = posture(arm.chain, state.q, _DAMPED_BELOW)
        per_joint = self.penalty == "per_joint"
        P, slope_P = limit_penalty(state.q, arm.q_min, arm.q_max, self.penalty_k, per_joint)
        slope, det = determinant_slope(arm.chain, state.q, now), now.det_JJt
        if self.measure == "absolute":
            det = max(np.sqrt(max(det, 0.0)), _LEAST_DET)
            slope = slope / (2.0 * det)
        by_joints = measure_gradient(now._replace(det_JJt=det), slope, P, slope_P)
        gradient: FloatArray = camera_gradient(now, by_joints)
        if state.A is not None:
            gradient = np.linalg.solve(state.A.T, gradient).astype(np.float64)
        return Avoidance(P * det, gradient)


@njit(cache=True, error_model="numpy")
def tracking_quadratic(
    features: FloatArray,
    focal_px: FloatArray,
    gains: TrackingGains,
    w: float,
    gradient: FloatArray,
) -> Quadratic:
    """Return the quadratic whose minimum is eq. (29), plus the motion along with the target.

    Args:
        features: x, y, desired x, desired y, depth, flow x, flow y of each, (M, 7).
        focal_px: (fx, fy).
        gains: the weights.
        w: w'(q).
        gradient: ∂w'/∂x along the camera's axes, (6,).
    """
    BtB, Bt_error, Bt_drift = image_square(features, focal_px, gains.period)
    H, A, along = np.zeros((6, 6)), np.zeros((6, 6)), np.zeros(6)
    for i in range(6):
        along[i] = -gains.Q * gains.controlled[i] * Bt_drift[i]
        for j in range(i + 1):
            square = gains.Q * gains.controlled[i] * gains.controlled[j] * BtB[i, j]
            H[i, j] = H[j, i] = A[i, j] = A[j, i] = square
        H[i, i] += gains.R[i]
        A[i, i] += SHARING * gains.R[i]
    u = tracking_displacement(BtB, Bt_error, gains, w, gradient)
    factor_spd(A)
    solve_factored(A, along)
    T = gains.period
    return Quadratic(T * T * H, T * times_six(H, u + along), 0.0)


def axis_mask(axes: tuple[str, ...]) -> BoolArray:
    """Return a mask of the named camera axes, (6,)."""
    return np.array([axis in axes for axis in AXES])
