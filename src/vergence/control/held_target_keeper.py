"""Keeps what the hand holds in view of a fixed camera, at the inner rate."""

from dataclasses import replace

import numpy as np

from vergence.arrays import FloatArray
from vergence.control.constrained_rates import ConstrainedRates
from vergence.control.objective import TwistObjective
from vergence.control.target_keeper import TargetKeeper
from vergence.geometry import se3_adjoint, se3_compose, se3_inverse
from vergence.signals import TargetState


class HeldTargetKeeper(TargetKeeper):
    """Turns wanted hand twists into joint rates before a fixed camera that watches what it holds.

    The hand's frame takes the place of the world's: in it the target stands and the camera is
    carried by the arm walked backwards. With A = -Ad(T_hand_camera), v_hand = A v_camera.

    Args:
        solver: what is kept; its arm is reversed, from the hand's frame to the camera, see
            `vergence.robot.reverse_arm`.
        corners: of the target, in its own frame, (M, 3), m.
    """

    def see(self, target: TargetState, wanted: FloatArray, now: float) -> None:
        """Take in a new estimate of the target, as `TargetKeeper.see`, but in the hand's frame."""
        assert target.T_world_hand is not None
        turn = np.kron(np.eye(4), target.T_world_hand[:3, :3].T)
        held = replace(
            target,
            T_world_target=se3_compose(se3_inverse(target.T_world_hand), target.T_world_target),
            velocity=turn[:6, :6] @ target.velocity,
            covariance=turn @ target.covariance @ turn.T,
        )
        super().see(held, wanted, now)

    def rates(
        self, position: FloatArray, velocity: FloatArray, twist: FloatArray, spare: FloatArray
    ) -> ConstrainedRates:
        """Return the joint rates for the next inner period that come nearest to a twist."""
        q, rates, free = (np.ascontiguousarray(row[::-1]) for row in (position, velocity, spare))
        A = -se3_adjoint(self._solver.arm.forward_kinematics(q))
        answer = self._answer(q, rates, free, TwistObjective(A.T @ A, A.T @ twist))
        asked = np.ascontiguousarray(answer.rates[::-1])
        return answer._replace(rates=asked, v_camera=A @ answer.v_camera)
