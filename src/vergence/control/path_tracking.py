"""Tracking a planned image trajectory."""

from typing import Literal, get_args

import numpy as np
from numba import njit

from vergence.arrays import FloatArray
from vergence.camera import Camera
from vergence.control.image_motion import FeatureState, ImageMotion
from vergence.control.redundancy import resolve_redundant
from vergence.errors import InputError
from vergence.features import interaction_matrix_points
from vergence.robot import Arm, jacobian
from vergence.signals import (
    ImagePoints,
    JointCommand,
    JointState,
    Observation,
    OutcomeKind,
    Reference,
)

Model = Literal["current", "desired", "mean"]
FEWEST = 3  # points that leave no direction of the camera open


@njit(cache=True)
def tracking_twist(
    L: FloatArray, error: FloatArray, feedforward: FloatArray, gain: float, damping: float
) -> FloatArray:
    """Return T_c = L̂⁺ (∂s*/∂t - λ (s - s*)), (6,), with L̂⁺ = (L̂ᵀ L̂ + μ I)⁻¹ L̂ᵀ.

    Args:
        L: model of the interaction matrix, (2M, 6).
        error: s - s*, normalized, (2M,).
        feedforward: ∂s*/∂t, normalized, (2M,), 1/s.
        gain: λ, 1/s.
        damping: μ, relative to the mean of the diagonal of L̂ᵀ L̂.
    """
    A = L.T @ L
    shift = damping * np.trace(A) / 6.0
    for i in range(6):
        A[i, i] += shift
    return np.linalg.solve(A, L.T @ (feedforward - gain * error)).astype(np.float64)


class PathTrackingLaw:
    """Keeps image points on their trajectory s*(t); [Mezouar2001] section 5.

    Everything is in normalized coordinates (the paper's s is in pixels, its L normalized). Points
    that were not found are left out. The depths are the planner's, so with any model of L an error
    of d* scales the translation only; the error it acts on stays small.

    Args:
        arm: up to the camera.
        camera: its intrinsics.
        gain: λ, 1/s.
        model: where L is taken: at s, at s*(t) as the paper does, or the mean of both.
        damping: of L's pseudo-inverse, relative.
        singular_below: singular values of J, relative to the largest, that are damped.
        flow_smoothing_s: of the object's own motion in the image, which is then fed forward, and
            latency undone; None for an object that stands.
    """

    def __init__(
        self,
        arm: Arm,
        camera: Camera,
        gain: float = 2.0,
        model: Model = "desired",
        damping: float = 1e-6,
        singular_below: float = 1e-2,
        flow_smoothing_s: float | None = None,
    ) -> None:
        if model not in get_args(Model):
            raise InputError("PathTrackingLaw", "model", model, ", ".join(get_args(Model)))
        if not gain > 0:
            raise InputError("PathTrackingLaw", "gain", gain, "a number above zero")
        self.arm, self.camera, self.gain, self.model = arm, camera, gain, model
        self.damping, self.singular_below = damping, singular_below
        self._motion = ImageMotion.of(arm, camera, flow_smoothing_s)

    def command(
        self, observation: Observation, reference: Reference, joints: JointState
    ) -> JointCommand:
        """Return joint rates for the next outer period; zero, with the reason, with few points."""
        view = observation.views[-1]
        found = np.flatnonzero(view.found)
        if len(found) < FEWEST:
            reason = f"{len(found)} of {len(view.found)} points found; {FEWEST} are needed"
            fault = (OutcomeKind.TARGET_LOST, reason)
            return JointCommand(np.zeros(self.arm.joint_count), np.zeros(6), fault=fault)
        (seen, flow, _), reference = self._now(view, reference, joints)
        assert reference.points_px is not None
        assert reference.depth_m is not None
        seen, wanted = seen[found], self.camera.normalize(reference.points_px[found])
        feedforward = -flow[found]
        if reference.velocity_px is not None:
            planned = self.camera.normalize_velocity(reference.velocity_px[found], wanted)
            feedforward = feedforward + planned
        L = self.interaction(seen, wanted, reference.depth_m[found])
        error = (seen - wanted).ravel()
        twist = tracking_twist(L, error, feedforward.ravel(), self.gain, self.damping)
        J = jacobian(self.arm.chain, joints.position)
        rest = np.zeros(self.arm.joint_count)
        rates = resolve_redundant(J, twist, rest, self.arm.rate_max, self.singular_below)
        return JointCommand(rates, J @ rates)

    def _now(
        self, view: ImagePoints, reference: Reference, joints: JointState
    ) -> tuple[FeatureState, Reference]:
        """Return features and reference at one and the same time: now, or the exposure."""
        assert reference.depth_m is not None
        if self._motion is None:
            points = self.camera.normalize(view.points_px)
            return FeatureState(points, np.zeros_like(points), reference.depth_m), reference
        features = self._motion.update(view, reference.depth_m, joints)
        return features, reference.at(joints.time)

    def interaction(self, seen: FloatArray, wanted: FloatArray, depth: FloatArray) -> FloatArray:
        """Return L̂, (2M, 6), at normalized points (M, 2) seen and wanted, depths (M,) in m."""
        seen, wanted, depth = (np.ascontiguousarray(a) for a in (seen, wanted, depth))
        if self.model == "current":
            L: FloatArray = interaction_matrix_points(seen, depth)
        elif self.model == "desired":
            L = interaction_matrix_points(wanted, depth)
        else:
            L = 0.5 * (
                interaction_matrix_points(seen, depth) + interaction_matrix_points(wanted, depth)
            )
        return L
