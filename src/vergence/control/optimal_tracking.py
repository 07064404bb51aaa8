"""Optimal tracking with singularity and joint limit avoidance, [Nelson1995]."""

from collections.abc import Sequence

import numpy as np

from vergence.arrays import BoolArray, FloatArray, frozen
from vergence.camera import Camera
from vergence.control.image_motion import ImageMotion
from vergence.control.singularity import singular_fault
from vergence.control.tracking_kernels import (
    TrackingGains,
    TrackingSetup,
    optimal_tracking_tick,
    pack_setup,
    unpack_tick,
)
from vergence.errors import InputError, nearest
from vergence.robot import Arm
from vergence.signals import JointCommand, JointState, Observation, Reference

AXES = ("x", "y", "z", "rx", "ry", "rz")


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
        flow_smoothing_s: of the target's motion in the image, which is then fed forward, and
            latency undone; None for the paper's law, which does neither.
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
        flow_smoothing_s: float | None = None,
    ) -> None:
        self.arm, self.camera = arm, camera
        self.depth_m = frozen(depth_m, (None,), "depth_m")
        controlled = axis_mask(axes, "axes")
        avoiding = axis_mask(avoidance_axes, "avoidance_axes")
        if stray := [axis for axis in avoidance_axes if axis not in axes]:
            raise InputError(
                "law", "avoidance_axes", ", ".join(stray), f"of axes: {', '.join(axes)}"
            )
        if not (self.depth_m > 0).all():
            raise InputError("law", "depth_m", depth_m, "depths above zero")
        R_axes = np.broadcast_to(weights_of(Q, R, axes), (len(axes),))
        if S < 0:
            raise InputError("law", "S", S, "0 or more")
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
        self.singular_below = singular_below
        self.setup = TrackingSetup(
            self.gains,
            camera.focal_px,
            float(penalty_k),
            penalty == "per_joint",
            singular_below,
            arm.q_min,
            arm.q_max,
            arm.rate_max,
            arm.chain,
        )
        self._packed = pack_setup(self.setup)
        self._motion = ImageMotion.of(arm, camera, flow_smoothing_s)
        self.feeds_forward = self._motion is not None

    def command(
        self, observation: Observation, reference: Reference, joints: JointState
    ) -> JointCommand:
        """Return joint rates for the next outer period."""
        view = observation.views[-1]
        assert reference.points_px is not None
        depth = self.depth_m if reference.depth_m is None else reference.depth_m
        if self._motion is None:
            seen, flow = self.camera.normalize(view.points_px), np.empty((len(depth), 0))
        else:
            seen, flow, depth = self._motion.update(view, depth, joints)
        wanted = self.camera.normalize(reference.points_px)
        features = np.column_stack((seen, wanted, depth, flow))[view.found]
        result = np.empty(self.arm.joint_count + 10)
        optimal_tracking_tick(*self._packed, joints.position, features, result)
        tick = unpack_tick(result)
        fault = singular_fault(tick.sigma, self.singular_below)
        active = ("joint rates",) if tick.scale < 1.0 else ()
        return JointCommand(tick.rates, tick.v_camera, tick.w, tick.penalty, active, fault)


def axis_mask(axes: Sequence[str], name: str) -> BoolArray:
    """Return which of the six camera axes are named, (6,).

    Raises:
        InputError: if an axis does not exist.
    """
    for axis in axes:
        if axis not in AXES:
            raise InputError("law", name, axis, nearest(axis, AXES))
    return np.array([axis in axes for axis in AXES])


def weights_of(Q: float, R: float | Sequence[float], axes: Sequence[str]) -> FloatArray:
    """Return R as an array, () or one for each axis.

    Raises:
        InputError: if Q or R is not above zero, or there are too many or too few.
    """
    weights = np.asarray(R, dtype=np.float64)
    if not Q > 0:
        raise InputError("law", "Q", Q, "a number above zero")
    if weights.shape not in ((), (len(axes),)):
        given = f"{weights.size} weights"
        raise InputError("law", "R", given, f"one, or {len(axes)}, one for each of the axes")
    if not (weights > 0).all():
        raise InputError("law", "R", R, "numbers above zero")
    return weights
