"""Position-based servoing: the hand kept at a wanted pose relative to the target."""

from dataclasses import replace

import numpy as np
from numba import njit

from vergence.arrays import FloatArray
from vergence.control.command import JointCommand
from vergence.control.hand_goal import goal_beside, goal_of_holder
from vergence.control.interpolator import MovingPose, interpolate, moved, pose_difference
from vergence.control.redundancy import resolve_redundant
from vergence.features import Observation, TargetState
from vergence.geometry import se3_adjoint, se3_compose, se3_inverse
from vergence.planning import Reference
from vergence.robot import Arm, Chain, JointState, forward_kinematics, jacobian

_ONSET_S = 0.5  # of the motion of redundant joints, so that no joint meets its acceleration limit


@njit(cache=True)
def hand_rates(
    chain: Chain,
    q: FloatArray,
    reference: MovingPose,
    gain: float,
    spare: FloatArray,
    rate_max: FloatArray,
    singular_below: float,
) -> FloatArray:
    """Return joint rates that keep the hand on a reference trajectory, (n,).

    q̇ = J⁺ (twist + gain · Δ(reference, hand)), the closed-loop inverse kinematics.

    Args:
        chain: with the hand as its tip.
        q: joint set-points, (n,).
        reference: where the hand should be, and how fast it should move.
        gain: 1/s.
        spare: rates wanted of redundant joints, (n,).
        rate_max: (n,).
        singular_below: see `resolve_redundant`.
    """
    T = forward_kinematics(chain, q)
    twist = reference.twist + gain * pose_difference(reference.T, T)
    R = np.ascontiguousarray(T[:3, :3].T)
    twist_hand = np.concatenate((R @ twist[:3], R @ twist[3:]))
    return resolve_redundant(jacobian(chain, q), twist_hand, spare, rate_max, singular_below)


class PositionBasedLaw:
    """Moves the hand so that the target keeps a wanted pose in a camera.

    The camera is the hand, [Lippiello2005] section IV, or it is fixed and the hand holds the
    target. Each picture gives a goal for the hand, see `goal_beside` and `goal_of_holder`. At the
    inner rate a second-order filter makes a trajectory of it, and closed-loop inverse kinematics
    gives the joint rates. By default the goal is predicted over the latency and its velocity fed
    forward; the paper does neither, and so lags.

    Args:
        arm: with the hand as its tip: the camera, or the frame `TargetState.T_world_hand` is of.
        period: the inner one, s.
        T_world_camera: pose of the fixed camera, (4, 4); None for a camera in the hand.
        filter_hz: natural frequency of the interpolating filter.
        damping: of that filter.
        feed_forward: whether the goal's velocity goes into the filter.
        prediction: whether the target's pose is predicted from the exposure to now.
        closed_loop_hz: how fast the joints make up for what the hand is behind.
        null_space: rate at which a spare joint leaves its limit, rad/s or m/s; it falls to zero
            in the middle of the joint's range.
        singular_below: singular values of the weighted Jacobian, relative to the largest, below
            which a direction is damped.
    """

    def __init__(
        self,
        arm: Arm,
        period: float,
        *,
        T_world_camera: FloatArray | None = None,
        filter_hz: float = 5.0,
        damping: float = 1.0,
        feed_forward: bool = True,
        prediction: bool = True,
        closed_loop_hz: float = 5.0,
        null_space: float = 0.5,
        singular_below: float = 0.02,
    ) -> None:
        self._arm, self._period, self._T_world_camera = arm, period, T_world_camera
        self._frequency, self._damping = 2 * np.pi * filter_hz, damping
        self._feed_forward, self._prediction = feed_forward, prediction
        self._gain = 2 * np.pi * closed_loop_hz
        self._null_space, self._singular_below = null_space, singular_below
        self._goal: MovingPose | None = None
        self._reference: MovingPose | None = None
        self._spare = np.zeros(arm.joint_count)  # what redundant joints do, gently begun

    def command(
        self, observation: Observation, reference: Reference, joints: JointState
    ) -> JointCommand:
        """Take the target's new pose as the goal; return the rates to set out with."""
        target, wanted = observation.target, reference.T_camera_target
        if target is None or wanted is None:
            self.hold()
            return JointCommand(np.zeros(self._arm.joint_count), np.zeros(6))
        self._goal = self._goal_of(target, wanted, joints.time)
        if self._reference is None:
            T_hand = forward_kinematics(self._arm.chain, joints.position)
            self._reference = MovingPose(T_hand, np.zeros(6))
        rates = self._rates(joints.position, self._reference)
        return JointCommand(rates, self._camera_twist(joints.position, rates))

    def follow(self, position: FloatArray) -> FloatArray:
        """Return joint rates (n,) for the next inner period from the last set-point (n,)."""
        if self._goal is None or self._reference is None:
            return np.zeros(self._arm.joint_count)
        ahead = interpolate(
            self._reference, self._goal, self._frequency, self._damping, self._period
        )
        # The place of now with the velocity that leads to the next one: no tick of lead or lag.
        rates = self._rates(position, MovingPose(self._reference.T, ahead.twist))
        self._reference = ahead
        self._goal = MovingPose(moved(self._goal, self._period), self._goal.twist)
        return rates

    def hold(self) -> None:
        """Forget the goal and the trajectory."""
        self._goal = self._reference = None
        self._spare = np.zeros(self._arm.joint_count)

    def _camera_twist(self, q: FloatArray, rates: FloatArray) -> FloatArray:
        """Return the camera's twist (6,) in its own frame; a fixed camera's as the hand sees it."""
        v_hand: FloatArray = jacobian(self._arm.chain, q) @ rates
        if self._T_world_camera is None:
            return v_hand
        T_world_hand = forward_kinematics(self._arm.chain, q)
        v_camera: FloatArray = (
            -se3_adjoint(se3_compose(se3_inverse(self._T_world_camera), T_world_hand)) @ v_hand
        )
        return v_camera

    def _goal_of(self, target: TargetState, wanted: FloatArray, now: float) -> MovingPose:
        """Return where the hand should be now, and how fast that place moves."""
        if self._prediction:
            seen = MovingPose(target.T_world_target, target.velocity)
            T_target = moved(seen, now - target.time)
            target = replace(target, time=now, T_world_target=T_target)
        if self._T_world_camera is None:
            goal = goal_beside(target, wanted)
        else:
            goal = goal_of_holder(target, se3_compose(self._T_world_camera, wanted))
        return goal if self._feed_forward else MovingPose(goal.T, np.zeros(6))

    def _rates(self, position: FloatArray, reference: MovingPose) -> FloatArray:
        away = -self._null_space * self._arm.normalized(position)
        self._spare = self._spare + self._period / _ONSET_S * (away - self._spare)
        rates: FloatArray = hand_rates(
            self._arm.chain,
            position,
            reference,
            self._gain,
            self._spare,
            self._arm.rate_max,
            self._singular_below,
        )
        return rates
