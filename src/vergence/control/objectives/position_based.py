"""Position-based visual servoing: keeps the target at a desired pose in the camera."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numba import njit

from vergence.arrays import FloatArray
from vergence.control.mounting import CameraMounting
from vergence.control.moving_pose import MovingPose, moved
from vergence.control.objectives._interpolator import interpolate
from vergence.control.objectives._pose_goal import tip_goal_beside, tip_goal_of_holder
from vergence.control.objectives.objective import CameraState, Quadratic
from vergence.errors import Absent, InputError
from vergence.geometry import pose_difference, se3_compose
from vergence.parts import knob, part
from vergence.robot import Arm, forward_kinematics, jacobian
from vergence.robot.chain import Chain
from vergence.signals import TargetState


class Lead(NamedTuple):
    """How a trajectory leads the tip to a goal."""

    frequency: float  # ω of the second-order filter, rad/s
    damping: float  # ζ of the filter
    gain: float  # with which the tip follows the trajectory, 1/s
    period_s: float  # inner


@part("objective", "position_based")
class PositionBased:
    """Moves the arm's tip so that the target keeps a desired pose in a camera.

    The camera is on the arm, [Lippiello2005] section IV, or it is fixed and the arm holds the
    target. Alone in a servo, it works at the inner rate: each image provides a goal, a second-order
    filter turns it into a trajectory, and closed-loop inverse kinematics computes the tip's twist.
    Combined with other objectives, the pose error decays at `closed_loop_hz`.
    """

    # Natural frequency of the second-order filter.
    filter_hz: float = knob(5.0, "Hz", above=0, upto=100)
    damping: float = knob(1.0, above=0, upto=100)  # damping ratio of the filter
    # Bandwidth with which the tip follows the filter.
    closed_loop_hz: float = knob(5.0, "Hz", above=0, upto=100)
    # Rate of redundant joints towards the middle of their range, in the null space.
    null_space_rate: float = knob(0.5, "rad/s or m/s", least=0, upto=10)

    def quadratic(self, state: CameraState) -> Quadratic:
        """Return the quadratic of ½ ‖v_tip - twist‖², at the image rate."""
        if state.target is None or state.T_camera_target is None:
            raise InputError(
                "position_based", "", Absent("no pose of the target"), "a task with a filter"
            )
        assert state.arm is not None
        assert state.q is not None
        assert state.mounting is not None
        goal = tip_goal(state.target, state.T_camera_target, state.mounting, state.time)
        twist = tip_twist(state.arm.chain, state.q, goal, 2 * np.pi * self.closed_loop_hz)
        if state.A is None:
            return Quadratic(np.eye(6), twist)
        inverse = np.linalg.inv(state.A)
        return Quadratic(inverse.T @ inverse, inverse.T @ twist)


def tip_goal(
    target: TargetState, T_camera_target: FloatArray, mounting: CameraMounting, now: float | None
) -> MovingPose:
    """Return the desired pose of the arm's tip and its velocity.

    Args:
        target: the estimate.
        T_camera_target: desired pose, (4, 4).
        mounting: of the camera.
        now: time to which the target is extrapolated, s; that of its image if None.
    """
    if now is not None:
        seen = MovingPose(target.T_world_target, target.velocity)
        T_target = moved(seen, now - target.time)
        target = replace(target, time=now, T_world_target=T_target)
    if mounting.T_world_camera is not None:
        return tip_goal_of_holder(target, se3_compose(mounting.T_world_camera, T_camera_target))
    if mounting.T_tip_camera is not None:
        return tip_goal_beside(target, se3_compose(mounting.T_tip_camera, T_camera_target))
    return tip_goal_beside(target, T_camera_target)


@njit(cache=True, error_model="numpy")
def tip_twist(chain: Chain, q: FloatArray, reference: MovingPose, gain: float) -> FloatArray:
    """Return the twist (6,) that keeps the tip on a reference trajectory, in its own frame.

    twist + gain · Δ(reference, tip), of the closed-loop inverse kinematics.

    Args:
        chain: up to the tip.
        q: joint set-points, (n,).
        reference: desired pose of the tip, and its velocity.
        gain: 1/s.
    """
    T = forward_kinematics(chain, q)
    asked = reference.twist + gain * pose_difference(reference.T, T)
    twist = np.zeros(6)
    for i in range(3):
        for j in range(3):
            twist[i] += T[j, i] * asked[j]
            twist[3 + i] += T[j, i] * asked[3 + j]
    return twist


@njit(cache=True, error_model="numpy")
def led_twist(
    chain: Chain, q: FloatArray, reference: MovingPose, goal: MovingPose, lead: Lead
) -> tuple[MovingPose, FloatArray]:
    """Return a trajectory a period ahead, and the twist (6,) of the tip that follows it there.

    The twist is that of the present pose with the next velocity.

    Args:
        chain: up to the tip.
        q: joint set-points, (n,).
        reference: present state of the trajectory.
        goal: that it leads to.
        lead: how it does.
    """
    ahead = interpolate(reference, goal, lead.frequency, lead.damping, lead.period_s)
    return ahead, tip_twist(chain, q, MovingPose(reference.T, ahead.twist), lead.gain)


class PoseTrajectory:
    """A trajectory of the arm's tip at the inner rate, from one goal to the next.

    Args:
        objective: its settings.
        arm: up to the tip.
        period_s: the inner period.
    """

    def __init__(self, objective: PositionBased, arm: Arm, period_s: float) -> None:
        self._arm = arm
        self._lead = Lead(
            2 * np.pi * objective.filter_hz,
            objective.damping,
            2 * np.pi * objective.closed_loop_hz,
            period_s,
        )
        self._goal: MovingPose | None = None
        self._reference: MovingPose | None = None
        self._ahead: MovingPose | None = None

    @property
    def planned(self) -> bool:
        """Whether there is a goal."""
        return self._goal is not None

    def take_over(self, previous: "PoseTrajectory") -> None:
        """Continue from the state of another trajectory."""
        self._goal, self._reference = previous._goal, previous._reference
        self._ahead = previous._ahead

    def aim(self, goal: MovingPose, q: FloatArray) -> None:
        """Set a new goal; without a trajectory, one begins at the present position, q (n,)."""
        self._goal = goal
        if self._reference is None:
            self._reference = MovingPose(forward_kinematics(self._arm.chain, q), np.zeros(6))

    def clear(self) -> None:
        """Clear the goal and the trajectory."""
        self._goal = self._reference = self._ahead = None

    def twist(self, q: FloatArray) -> FloatArray:
        """Return the tip's twist (6,) now, at joint positions q (n,)."""
        assert self._reference is not None
        twist: FloatArray = tip_twist(self._arm.chain, q, self._reference, self._lead.gain)
        return twist

    def next_twist(self, q: FloatArray) -> FloatArray:
        """Return the twist (6,) for the next period, see `led_twist`."""
        assert self._goal is not None
        assert self._reference is not None
        self._ahead, twist = led_twist(self._arm.chain, q, self._reference, self._goal, self._lead)
        return twist

    def advance(self, q: FloatArray, rates: FloatArray, held_back: bool) -> None:
        """Advance by one inner period.

        Args:
            q: joint set-points, (n,).
            rates: as commanded, (n,).
            held_back: whether they differ from the twist; the trajectory then continues from where
                the tip will be.
        """
        assert self._goal is not None
        self._reference = self._moving_tip(q, rates) if held_back else self._ahead
        self._goal = MovingPose(moved(self._goal, self._lead.period_s), self._goal.twist)

    def _moving_tip(self, q: FloatArray, rates: FloatArray) -> MovingPose:
        after = q + self._lead.period_s * rates
        T = forward_kinematics(self._arm.chain, after)
        v = jacobian(self._arm.chain, after) @ rates
        return MovingPose(T, np.concatenate((T[:3, :3] @ v[:3], T[:3, :3] @ v[3:])))
