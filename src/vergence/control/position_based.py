"""Position-based servoing: the hand kept at a wanted pose relative to the target."""

from dataclasses import replace

import numpy as np
from numba import njit

from vergence.arrays import FloatArray
from vergence.control.constrained_rates import ConstrainedRates
from vergence.control.hand_goal import goal_beside, goal_of_holder
from vergence.control.interpolator import MovingPose, interpolate, moved, pose_difference
from vergence.control.redundancy import resolve_redundant
from vergence.control.target_keeper import TargetKeeper, held_back
from vergence.geometry import se3_adjoint, se3_compose, se3_inverse
from vergence.robot import Arm, Chain, forward_kinematics, jacobian
from vergence.signals import JointCommand, JointState, Observation, Reference, Setpoint, TargetState

_ONSET_S = 0.5  # of the motion of redundant joints, so that no joint meets its acceleration limit


@njit(cache=True)
def hand_twist(chain: Chain, q: FloatArray, reference: MovingPose, gain: float) -> FloatArray:
    """Return the twist that keeps the hand on a reference trajectory, in its own axes, (6,).

    twist + gain · Δ(reference, hand), of the closed-loop inverse kinematics.

    Args:
        chain: with the hand as its tip.
        q: joint set-points, (n,).
        reference: where the hand should be, and how fast it should move.
        gain: 1/s.
    """
    T = forward_kinematics(chain, q)
    twist = reference.twist + gain * pose_difference(reference.T, T)
    R = np.ascontiguousarray(T[:3, :3].T)
    return np.concatenate((R @ twist[:3], R @ twist[3:]))


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
    """Return joint rates that keep the hand on a reference trajectory, (n,): q̇ = J⁺ twist.

    Args:
        chain: with the hand as its tip.
        q: joint set-points, (n,).
        reference: where the hand should be, and how fast it should move.
        gain: see `hand_twist`.
        spare: rates wanted of redundant joints, (n,).
        rate_max: (n,).
        singular_below: see `resolve_redundant`.
    """
    twist = hand_twist(chain, q, reference, gain)
    return resolve_redundant(jacobian(chain, q), twist, spare, rate_max, singular_below)


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
        keeper: keeps limits, view and distance from singularities on the way; without one the hand
            is moved with nothing else in mind, and the guard alone keeps the joints.
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
        keeper: TargetKeeper | None = None,
    ) -> None:
        self._arm, self._period, self._T_world_camera = arm, period, T_world_camera
        self._frequency, self._damping = 2 * np.pi * filter_hz, damping
        self._feed_forward, self._prediction = feed_forward, prediction
        self._gain = 2 * np.pi * closed_loop_hz
        self._null_space, self._singular_below = null_space, singular_below
        self._keeper = keeper
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
        if self._keeper is not None:
            self._keeper.see(target, wanted, joints.time)
            said = self._keeper.report()
            answer = self._keep(self._keeper, joints, self._reference)[0]
            measures = answer.manipulability, answer.penalty
            v_camera = self._camera_twist(joints.position, answer.rates)
            return JointCommand(
                answer.rates, v_camera, *measures, said.active, given_up=said.given_up
            )
        rates = self._rates(joints, self._reference)[0]
        return JointCommand(rates, self._camera_twist(joints.position, rates))

    def follow(self, setpoint: Setpoint) -> FloatArray:
        """Return joint rates (n,) for the next inner period from the last set-point."""
        if self._goal is None or self._reference is None:
            return np.zeros(self._arm.joint_count)
        ahead = interpolate(
            self._reference, self._goal, self._frequency, self._damping, self._period
        )
        # The place of now with the velocity that leads to the next one: no tick of lead or lag.
        rates, free = self._rates(setpoint, MovingPose(self._reference.T, ahead.twist))
        self._reference = ahead if free else self._moving_hand(setpoint.position, rates)
        if self._keeper is not None:
            self._keeper.advance()
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

    def _rates(
        self, joints: JointState | Setpoint, reference: MovingPose
    ) -> tuple[FloatArray, bool]:
        """Return joint rates (n,), and whether nothing that is kept held the hand back."""
        if self._keeper is not None:
            answer, free = self._keep(self._keeper, joints, reference)
            return answer.rates, free
        rates: FloatArray = hand_rates(
            self._arm.chain,
            joints.position,
            reference,
            self._gain,
            self._spare_rates(joints.position),
            self._arm.rate_max,
            self._singular_below,
        )
        return rates, True

    def _keep(
        self, keeper: TargetKeeper, joints: JointState | Setpoint, reference: MovingPose
    ) -> tuple[ConstrainedRates, bool]:
        twist = hand_twist(self._arm.chain, joints.position, reference, self._gain)
        spare = self._spare_rates(joints.position)
        answer = keeper.rates(joints.position, joints.velocity, twist, spare)
        return answer, not held_back(answer, twist)

    def _spare_rates(self, position: FloatArray) -> FloatArray:
        """Return what redundant joints should do, (n,), gently begun."""
        away = -self._null_space * self._arm.normalized(position)
        self._spare = self._spare + self._period / _ONSET_S * (away - self._spare)
        return self._spare

    def _moving_hand(self, position: FloatArray, rates: FloatArray) -> MovingPose:
        """Return where the hand will be, so that the trajectory goes on from there."""
        after = position + self._period * rates
        T = forward_kinematics(self._arm.chain, after)
        v_hand = jacobian(self._arm.chain, after) @ rates
        return MovingPose(T, np.concatenate((T[:3, :3] @ v_hand[:3], T[:3, :3] @ v_hand[3:])))
