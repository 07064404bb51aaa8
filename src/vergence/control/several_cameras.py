"""One task, several cameras: one in the hand, others on the wall that look at the hand."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from vergence.arrays import FloatArray, frozen
from vergence.control.camera_share import CameraShare
from vergence.control.constrained_rates import joint_objective
from vergence.control.constrained_solver import ConstrainedSolver, command_of
from vergence.control.constraints import pack_features
from vergence.control.image_motion import ImageMotion
from vergence.control.objective import TwistObjective, seen_only
from vergence.control.resolve import slow_down
from vergence.robot import Arm, reverse_arm
from vergence.signals import ImagePoints, JointCommand, JointState, Observation, Reference

_STALE_S = 0.3  # what a camera saw longer ago no longer counts
_NO_FEATURES = pack_features(np.empty((0, 2)), np.empty((0, 2)), np.empty(0))


class SeveralCamerasLaw:
    """Serves the objectives of all cameras at once, each where the others leave a choice.

    Minimise Σ_c (½ v_cᵀ H_c v_c - g_cᵀ v_c) + μ/2 ‖q̇‖² with v_c = A_c J q̇, see `CameraShare`: all
    cameras together are one objective in the twist of the hand. A camera that has lost its
    features, or sends no pictures, has no say. The joint rates come from the constrained solver if
    there is one, which keeps the first camera's features in view; else rates above their limits
    slow the whole arm.

    Args:
        arm: up to the first camera, which it carries.
        shares: by the camera's name; the reference's own points are for the first of them.
        solver: what is kept, for the arm and the first camera; None for nothing.
        flow_smoothing_s: of the motion of what they look at; infinite if it stands.
        carries_depth: whether the depth is carried on by the camera's motion, see `ImageMotion`.
        damping: μ without a solver, so that directions that no camera sees do not move.
    """

    def __init__(
        self,
        arm: Arm,
        shares: Mapping[str, CameraShare],
        *,
        solver: ConstrainedSolver | None = None,
        flow_smoothing_s: float = np.inf,
        carries_depth: bool = False,
        damping: float = 1e-6,
    ) -> None:
        self._arm, self._shares, self._solver = arm, dict(shares), solver
        self._damping = damping
        self._first = next(iter(self._shares))
        self._motions = {
            name: ImageMotion(
                self._carrier(share),
                share.camera,
                flow_smoothing_s,
                carries_depth=carries_depth,
            )
            for name, share in self._shares.items()
        }
        self._views: dict[str, ImagePoints] = {}

    def command(
        self, observation: Observation, reference: Reference, joints: JointState
    ) -> JointCommand:
        """Return joint rates for the next outer period."""
        self._views |= {view.camera: view for view in observation.views}
        T_world_hand = self._arm.forward_kinematics(joints.position)
        H, g, features = np.zeros((6, 6)), np.zeros(6), _NO_FEATURES
        for name, view in self._views.items():
            if joints.time - view.time > _STALE_S:
                continue
            objective, seen = self._objective(name, view, reference, joints)
            A = self._shares[name].twist_of(T_world_hand)
            H, g = H + A.T @ objective.H @ A, g + A.T @ objective.g
            if name == self._first:
                features = seen
        return self._resolve(TwistObjective(H, g), features, joints)

    def _carrier(self, share: CameraShare) -> Arm:
        """Return the arm that carries a camera before what it looks at."""
        T_world_camera = share.T_world_camera
        return self._arm if T_world_camera is None else reverse_arm(self._arm, T_world_camera)

    def _objective(
        self, name: str, view: ImagePoints, reference: Reference, joints: JointState
    ) -> tuple[TwistObjective, FloatArray]:
        """Return one camera's quadratic in its twist, and its features as the solver has them."""
        share = self._shares[name]
        if name != self._first:
            reference = Reference(reference.time, reference.elsewhere_px[name])
        if share.T_world_camera is not None:
            joints = replace(joints, position=frozen(joints.position[::-1]))
        now = self._motions[name].update(view, share.depth_m, joints)
        seen = seen_only(now, view.found, now.depth, reference.at(joints.time))
        return share.objective.twist_objective(*seen), pack_features(*seen[0])

    def _resolve(
        self, objective: TwistObjective, features: FloatArray, joints: JointState
    ) -> JointCommand:
        if self._solver is not None:
            return command_of(
                self._solver.solve(joints.position, joints.velocity, objective, features)
            )
        J = self._arm.jacobian(joints.position)
        H, g = joint_objective(objective.H, objective.g, J, self._damping)
        rates = np.linalg.solve(H, g).astype(np.float64)
        scale = slow_down(rates, self._arm.rate_max)
        return JointCommand(rates, J @ rates, active=("joint rates",) if scale < 1.0 else ())
