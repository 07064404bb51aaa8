"""Tracking a planned image trajectory."""

from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from numba import njit

from vergence.arrays import FloatArray
from vergence.camera import Camera
from vergence.control.command import JointCommand
from vergence.control.redundancy import resolve_redundant
from vergence.errors import InputError
from vergence.features import Observation, interaction_matrix_points
from vergence.outcome import OutcomeKind
from vergence.planning import Reference
from vergence.robot import Arm, JointState, jacobian

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


@dataclass(frozen=True, slots=True)
class PathTrackingLaw:
    """Keeps image points on their trajectory s*(t); [Mezouar2001] section 5.

    Everything is in normalized coordinates (the paper's s is in pixels, its L normalized). Points
    that were not found are left out. The depths are the planner's, so with any model of L an error
    of d* scales the translation only; the error it acts on stays small.
    """

    arm: Arm
    camera: Camera
    gain: float = 2.0  # λ, 1/s
    model: Model = "desired"  # where L is taken: s, s*(t) as the paper does, or the mean of both
    damping: float = 1e-6  # of L's pseudo-inverse
    singular_below: float = 1e-2  # singular values of J, relative to the largest, that are damped

    def __post_init__(self) -> None:
        if self.model not in get_args(Model):
            allowed = ", ".join(get_args(Model))
            raise InputError("PathTrackingLaw", "model", self.model, allowed)
        if not self.gain > 0:
            raise InputError("PathTrackingLaw", "gain", self.gain, "a number above zero")

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
        assert reference.points_px is not None
        assert reference.depth_m is not None
        seen = self.camera.normalize(view.points_px[found])
        wanted = self.camera.normalize(reference.points_px[found])
        feedforward = np.zeros_like(wanted)
        if reference.velocity_px is not None:
            feedforward = self.camera.normalize_velocity(reference.velocity_px[found], wanted)
        L = self.interaction(seen, wanted, reference.depth_m[found])
        error = (seen - wanted).ravel()
        twist = tracking_twist(L, error, feedforward.ravel(), self.gain, self.damping)
        J = jacobian(self.arm.chain, joints.position)
        rest = np.zeros(self.arm.joint_count)
        rates = resolve_redundant(J, twist, rest, self.arm.rate_max, self.singular_below)
        return JointCommand(rates, J @ rates)

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
