"""Optimal tracking with singularity and joint limit avoidance, [Nelson1995]."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numba import njit

from vergence.arrays import BoolArray, FloatArray, frozen
from vergence.camera import Camera
from vergence.control.command import JointCommand
from vergence.control.resolve import resolve_twist
from vergence.errors import InputError, nearest
from vergence.features import Observation, interaction_matrix_points
from vergence.outcome import OutcomeKind
from vergence.planning import Reference
from vergence.robot import Arm, Chain, JointState, Manipulability, manipulability

AXES = ("x", "y", "z", "rx", "ry", "rz")


class TrackingGains(NamedTuple):
    """The weights of the objective (28), packed for the kernel."""

    Q: float  # on the feature errors, 1/px²
    R: FloatArray  # (6,) on the camera's displacement a frame, 1/m² and 1/rad²
    S: float  # on 1/w'
    controlled: FloatArray  # (6,) 1 for an axis that is controlled, else 0
    avoiding: FloatArray  # (6,) 1 for an axis along which ∇w' acts, else 0
    avoidance_max: float  # largest avoidance displacement a frame, m (and rad)
    period: float  # T, s


@njit(cache=True)
def tracking_displacement(
    error_px: FloatArray, B: FloatArray, gains: TrackingGains, w: float, gradient: FloatArray
) -> FloatArray:
    """Return u, the camera's displacement over the next frame, (6,), by [Nelson1995] eq. (29).

    u = -(Bᵀ Q B + R)⁻¹ [Bᵀ Q (x - x_D) - S/(2 w'²) ∇_u w'], over the controlled axes only. With
    the paper's gains u is a displacement a frame, so T is 1 in B but stays in ∇_u (31).

    The avoidance term grows without bound as w' vanishes, which in discrete time throws the arm;
    its share of u is bounded to `avoidance_max`.

    Args:
        error_px: x - x_D of the features found, (2M,).
        B: (2M, 6), px per m and per rad.
        gains: the weights.
        w: w'(q).
        gradient: ∂w'/∂x along the camera's axes, (6,), per m and per rad.
    """
    H = np.eye(6)
    g = np.zeros(6)
    for i in range(6):
        if gains.controlled[i] == 0.0:
            continue
        for r in range(len(B)):
            g[i] -= gains.Q * B[r, i] * error_px[r]
        for j in range(6):
            if gains.controlled[j] == 0.0:
                continue
            total = gains.R[i] if i == j else 0.0
            for r in range(len(B)):
                total += gains.Q * B[r, i] * B[r, j]
            H[i, j] = total
    factor = cholesky(H)
    u = cholesky_solve(factor, g)
    if gains.S > 0.0 and w > 0.0:
        scale = gains.S / (2.0 * w * w) * gains.period
        away = cholesky_solve(factor, scale * gradient * gains.avoiding * gains.controlled)
        size = np.sqrt(np.sum(away * away))
        u += away * min(1.0, gains.avoidance_max / max(size, 1e-300))
    return u


@njit(cache=True)
def cholesky(A: FloatArray) -> FloatArray:
    """Return the lower factor G of a positive definite matrix, A = G Gᵀ."""
    n = len(A)
    G = np.zeros((n, n))
    for i in range(n):
        for j in range(i + 1):
            total = A[i, j]
            for k in range(j):
                total -= G[i, k] * G[j, k]
            G[i, j] = np.sqrt(total) if i == j else total / G[j, j]
    return G


@njit(cache=True)
def cholesky_solve(G: FloatArray, b: FloatArray) -> FloatArray:
    """Solve G Gᵀ x = b."""
    n = len(b)
    x = b.copy()
    for i in range(n):
        for k in range(i):
            x[i] -= G[i, k] * x[k]
        x[i] /= G[i, i]
    for i in range(n - 1, -1, -1):
        for k in range(i + 1, n):
            x[i] -= G[k, i] * x[k]
        x[i] /= G[i, i]
    return x


@njit(cache=True)
def optimal_tracking_tick(
    chain: Chain,
    limits: FloatArray,
    q: FloatArray,
    points: FloatArray,
    desired: FloatArray,
    depth: FloatArray,
    focal_px: FloatArray,
    gains: TrackingGains,
    penalty_k: float,
    per_joint: bool,
    damping: float,
) -> tuple[FloatArray, FloatArray, float, Manipulability]:
    """Return joint rates (n,), camera twist (6,), the scale that kept the rates, and w'.

    Args:
        chain: the arm up to its camera.
        limits: rows q_min, q_max, rate_max, (3, n).
        q: joint positions, (n,).
        points: features, normalized coordinates, (M, 2).
        desired: where they should be, (M, 2).
        depth: of the features, (M,), m.
        focal_px: (fx, fy).
        gains: the weights.
        penalty_k: steepness of the penalty (27).
        per_joint: whether the penalty is taken joint by joint.
        damping: smallest singular value below which J⁻¹ is damped.
    """
    m = manipulability(chain, q, limits[0], limits[1], penalty_k, per_joint, damping)
    B = interaction_matrix_points(points, depth)
    error_px = np.empty(len(B))
    for j in range(len(points)):
        for a in range(2):
            error_px[2 * j + a] = (points[j, a] - desired[j, a]) * focal_px[a]
            for i in range(6):
                B[2 * j + a, i] *= focal_px[a]
    u = tracking_displacement(error_px, B, gains, m.value, m.gradient_camera)
    v_camera = u / gains.period
    rates, scale = resolve_twist(m.J_inverse, v_camera, limits[2])
    return rates, v_camera, scale, m


class OptimalTrackingLaw:
    """The control law (29) as a part of the loop: observation and reference in, joint rates out.

    F = (x - x_D)ᵀ Q (x - x_D) + uᵀ R u + S / w'(q), [Nelson1995] eq. (28): feature errors and
    camera motion cost, and so does a poor configuration of the arm. The paper's two-axis and
    four-axis strategies are choices of `axes`; with three or more features and all six axes it
    keeps the whole pose.

    Args:
        arm: the arm, up to its camera.
        camera: intrinsics of that camera.
        depth_m: depth of the features, (M,), used where the reference knows none.
        axes: controlled axes of the camera, of x, y, z, rx, ry, rz.
        avoidance_axes: axes along which ∇w' acts; a subset of `axes`.
        Q: weight on the feature errors, 1/px².
        R: weight on camera motion, one number or one for each of `axes`.
        S: weight on 1/w'.
        period: time between pictures, s.
        penalty: "product" for (27) as printed, "per_joint" for a penalty joint by joint.
        penalty_k: steepness of the penalty.
        avoidance_speed_max: bound on the speed spent on avoidance, m/s.
        singular_below: smallest singular value of J at which the law gives up.
    """

    def __init__(
        self,
        arm: Arm,
        camera: Camera,
        depth_m: FloatArray,
        *,
        axes: Sequence[str] = AXES,
        avoidance_axes: Sequence[str] = (),
        Q: float = 2e-6,
        R: float | Sequence[float] = 10.0,
        S: float = 0.0,
        period: float = 1 / 30,
        penalty: str = "product",
        penalty_k: float = 1e5,
        avoidance_speed_max: float = 0.5,
        singular_below: float = 0.02,
    ) -> None:
        self.arm, self.camera = arm, camera
        self.depth_m = frozen(depth_m, (None,), "depth_m")
        controlled = axis_mask(axes, "axes")
        avoiding = axis_mask(avoidance_axes, "avoidance_axes")
        if (avoiding & ~controlled).any():
            raise InputError("law", "avoidance_axes", list(avoidance_axes), "a subset of axes")
        if not (self.depth_m > 0).all():
            raise InputError("law", "depth_m", depth_m, "depths above zero")
        R_axes = np.broadcast_to(np.asarray(R, dtype=np.float64), (len(axes),))
        if not (R_axes > 0).all() or Q <= 0 or S < 0:
            raise InputError("law", "Q, R, S", (Q, R, S), "Q > 0, R > 0, S >= 0")
        R_full = np.ones(6)
        R_full[[AXES.index(axis) for axis in axes]] = R_axes
        self.gains = TrackingGains(
            float(Q),
            R_full,
            float(S),
            controlled.astype(np.float64),
            avoiding.astype(np.float64),
            avoidance_speed_max * period,
            period,
        )
        self.penalty_k, self.per_joint = float(penalty_k), penalty == "per_joint"
        self.singular_below = singular_below
        self._limits = np.vstack((arm.q_min, arm.q_max, arm.rate_max))

    def command(
        self, observation: Observation, reference: Reference, joints: JointState
    ) -> JointCommand:
        """Return joint rates for the next outer period."""
        view = observation.views[-1]
        assert reference.points_px is not None
        depth = self.depth_m if reference.depth_m is None else reference.depth_m
        found = view.found
        rates, v_camera, scale, m = optimal_tracking_tick(
            self.arm.chain,
            self._limits,
            joints.position,
            self.camera.normalize(view.points_px[found]),
            self.camera.normalize(reference.points_px[found]),
            depth[found],
            self.camera.focal_px,
            self.gains,
            self.penalty_k,
            self.per_joint,
            self.singular_below,
        )
        sigma = m.smallest_singular_value
        fault = None
        if sigma < self.singular_below:
            fault = (
                OutcomeKind.SINGULARITY,
                f"the smallest singular value of the Jacobian fell to {sigma:.3g} "
                f"(limit {self.singular_below:g})",
            )
        active = ("joint rates",) if scale < 1.0 else ()
        return JointCommand(rates, v_camera, m.value, m.penalty, active, fault)


def axis_mask(axes: Sequence[str], name: str) -> BoolArray:
    """Return which of the six camera axes are named, (6,).

    Raises:
        InputError: if an axis does not exist.
    """
    for axis in axes:
        if axis not in AXES:
            raise InputError("law", name, axis, nearest(axis, AXES))
    return np.array([axis in axes for axis in AXES])
