"""One task, several cameras: some in the hand, some on the wall that look at the hand."""

from collections.abc import Mapping

import numpy as np

from vergence.arrays import FloatArray
from vergence.control.camera_share import CameraShare
from vergence.control.command import JointCommand
from vergence.control.constrained_rates import joint_objective
from vergence.control.image_motion import ImageMotion
from vergence.control.objective import seen_only
from vergence.control.resolve import slow_down
from vergence.features import ImagePoints, Observation
from vergence.planning import Reference
from vergence.robot import JointState

_STALE_S = 0.3  # what a camera saw longer ago no longer counts


class SeveralCamerasLaw:
    """Serves the objectives of all cameras in one least-squares problem of the joint rates.

    Minimise Σ_c (½ v_cᵀ H_c v_c - g_cᵀ v_c) + μ/2 ‖q̇‖² with v_c = J_c q̇: each camera has its say
    about the directions that it sees, and what one leaves open another may decide. A camera that
    has lost its features, or sends no pictures, has no say. Rates above their limits slow the whole
    arm.

    Args:
        shares: by the camera's name; the reference's own points are for the first of them.
        flow_smoothing_s: of the motion of what they look at; infinite if it stands.
        damping: μ, so that directions that no camera sees do not move.
    """

    def __init__(
        self,
        shares: Mapping[str, CameraShare],
        *,
        flow_smoothing_s: float = np.inf,
        damping: float = 1e-6,
    ) -> None:
        self._shares, self._damping = dict(shares), damping
        self._first = next(iter(self._shares))
        self._motions = {
            name: ImageMotion(share.arm, share.camera, flow_smoothing_s)
            for name, share in self._shares.items()
        }
        self._views: dict[str, ImagePoints] = {}

    def command(
        self, observation: Observation, reference: Reference, joints: JointState
    ) -> JointCommand:
        """Return joint rates for the next outer period."""
        self._views |= {view.camera: view for view in observation.views}
        n = len(joints.position)
        H, g = self._damping * np.eye(n), np.zeros(n)
        for name, view in self._views.items():
            if joints.time - view.time < _STALE_S:
                H_share, g_share = self._in_joints(name, view, reference, joints)
                H, g = H + H_share, g + g_share
        rates = np.linalg.solve(H, g).astype(np.float64)
        first = self._shares[self._first]
        scale = slow_down(rates, first.arm.rate_max)
        active = ("joint rates",) if scale < 1.0 else ()
        return JointCommand(rates, first.jacobian(joints) @ rates, active=active)

    def _in_joints(
        self, name: str, view: ImagePoints, reference: Reference, joints: JointState
    ) -> tuple[FloatArray, FloatArray]:
        """Return one camera's quadratic in the joint rates: H (n, n) and g (n,)."""
        share = self._shares[name]
        if name != self._first:
            reference = Reference(reference.time, reference.elsewhere_px[name])
        features = self._motions[name].update(view, share.depth_m, share.joints(joints))
        seen = seen_only(features, view.found, share.depth_m, reference)
        H, g = share.objective.twist_objective(*seen)
        in_joints: tuple[FloatArray, FloatArray] = joint_objective(
            H, g, share.jacobian(joints), 0.0
        )
        return in_joints
