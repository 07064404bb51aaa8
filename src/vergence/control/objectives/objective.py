"""Input and result of an objective: a quadratic in the camera's twist or in the joint rates."""

from dataclasses import dataclass
from typing import NamedTuple, Protocol, runtime_checkable

import numpy as np
from numba import njit

from vergence.arrays import FloatArray, as_floats
from vergence.camera import Camera
from vergence.control.mounting import CameraMounting
from vergence.features import Points
from vergence.robot import Arm
from vergence.signals import TargetState


class Quadratic(NamedTuple):
    """Minimise ½ vᵀ H v - gᵀ v over the camera's twist v = v_camera."""

    H: FloatArray  # (6, 6) positive semi-definite
    g: FloatArray  # (6,)
    variance: float = 0.0  # variance of the rows of which H and g are made, caused by image noise


class JointQuadratic(NamedTuple):
    """Minimise ½ q̇ᵀ H q̇ - gᵀ q̇ over the joint rates."""

    H: FloatArray  # (n, n) positive semi-definite
    g: FloatArray  # (n,)


@dataclass(slots=True)
class CameraState:
    """The data of one camera at one tick for objectives; features that were not found are left out.

    Attributes:
        mounting: the camera and its pose; None for an objective used without an arm.
        points: present features, normalized coordinates, (M, 2).
        depth_m: of the features, (M,).
        flow: caused by the target's own motion, (M, 2), 1/s.
        desired_points: s_star, normalized coordinates, (M, 2); None if there are none.
        desired_velocity: of s_star, (M, 2), 1/s; None for a stationary one.
        desired_depth_m: depth of the features at the goal, (M,); None if unknown.
        count: number of features, found or not.
        period_s: between two images, s.
        arm: up to its tip; None for an objective used without an arm.
        q: joint positions, (n,).
        A: v_camera = A v_tip, (6, 6); None for a camera at the tip.
        T_world_tip: pose of the arm's tip, (4, 4).
        target: estimated pose and velocity of the target; None if no filter runs.
        T_camera_target: desired pose of the target, (4, 4); None if there is none.
        time: now, s.
        depth_share: largest relative standard deviation of a depth; NaN if unknown.
        weights: roots (M, 2, 2) of the weights of each feature's rows; all 1 if None.
        variance: of a feature's weighted row, caused by image noise; normalized.
        faces: that must stay turned to the camera, see `Problem`; None if unknown.
    """

    mounting: CameraMounting | None
    points: FloatArray
    depth_m: FloatArray
    flow: FloatArray
    desired_points: FloatArray | None = None
    desired_velocity: FloatArray | None = None
    desired_depth_m: FloatArray | None = None
    count: int = 0
    period_s: float = 1 / 30
    arm: Arm | None = None
    q: FloatArray | None = None
    A: FloatArray | None = None
    T_world_tip: FloatArray | None = None
    target: TargetState | None = None
    T_camera_target: FloatArray | None = None
    time: float = 0.0
    depth_share: float = float("nan")
    weights: FloatArray | None = None
    variance: float = 0.0
    faces: FloatArray | None = None

    @property
    def camera(self) -> Camera:
        """The camera's intrinsics."""
        assert self.mounting is not None
        return self.mounting.camera

    @property
    def features(self) -> Points:
        """The present features."""
        return Points(self.points, self.depth_m)

    @property
    def depth_at_goal(self) -> FloatArray:
        """Depth of the features at the goal, (M,), m; the present one if that is unknown."""
        return self.depth_m if self.desired_depth_m is None else self.desired_depth_m

    @property
    def desired(self) -> Points:
        """The desired features."""
        assert self.desired_points is not None
        return Points(self.desired_points, self.depth_at_goal)

    @property
    def J_camera(self) -> FloatArray:
        """The camera's Jacobian, (6, n): v_camera = J q̇."""
        assert self.arm is not None
        assert self.q is not None
        J = self.arm.jacobian(self.q)
        return J if self.A is None else self.A @ J


def state_of(features: Points, desired: Points) -> CameraState:
    """Return the state of a camera without an arm for given present and desired features."""
    return CameraState(
        None,
        features.points,
        features.depth_m,
        np.zeros_like(features.points),
        desired.points,
        desired_depth_m=desired.depth_m,
        count=len(features.points),
    )


@runtime_checkable
class Objective(Protocol):
    """What the camera, or the arm, should do.

    A class attribute `supplements = True` marks one that only adds to others, such as a posture.
    """

    def quadratic(self, state: CameraState) -> Quadratic | JointQuadratic:
        """Return the quadratic for this tick."""
        ...


def least_squares(
    E: FloatArray,
    desired: FloatArray,
    weight: FloatArray | float = 1.0,
    damping: FloatArray | float = 1e-6,
) -> Quadratic:
    """Return the quadratic of ½ Σ wᵣ (E v - ė)ᵣ² + ½ vᵀ diag(μ) v.

    Args:
        E: (k, 6).
        desired: ė, the desired value of E v, (k,).
        weight: w of each row, (k,), or one number.
        damping: μ of each axis, (6,), or one number.

    Raises:
        ShapeError: if the shapes do not fit.
    """
    E = np.ascontiguousarray(as_floats(E, (None, 6), "E"))
    result: Quadratic = least_squares_kernel(
        E,
        np.ascontiguousarray(as_floats(desired, (len(E),), "desired")),
        _each(weight, len(E), "weight"),
        _each(damping, 6, "damping"),
    )
    return result


def _each(values: FloatArray | float, count: int, name: str) -> FloatArray:
    """Return one value for each of several, (count,)."""
    if np.ndim(values) == 0:
        return np.full(count, values, dtype=np.float64)
    return np.ascontiguousarray(as_floats(values, (count,), name))


@njit(cache=True, error_model="numpy")
def least_squares_kernel(
    E: FloatArray, desired: FloatArray, weight: FloatArray, R: FloatArray
) -> Quadratic:
    """Return the quadratic of ‖E v - desired‖² weighted by rows, plus vᵀ diag(R) v.

    Args:
        E: (m, 6).
        desired: (m,).
        weight: (m,).
        R: (6,).
    """
    H, g = np.zeros((6, 6)), np.zeros(6)
    for i in range(6):
        for r in range(len(E)):
            g[i] += weight[r] * E[r, i] * desired[r]
        for j in range(i + 1):
            total = R[i] if i == j else 0.0
            for r in range(len(E)):
                total += weight[r] * E[r, i] * E[r, j]
            H[i, j] = H[j, i] = total
    return Quadratic(H, g)
