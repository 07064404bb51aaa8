"""Position-based servoing at the inner rate."""

import numpy as np
from numba import njit

from vergence.arrays import FloatArray
from vergence.control.limits import Limits, TargetView
from vergence.control.mounting import CameraMounting
from vergence.control.moving_pose import MovingPose
from vergence.control.objectives import PoseTrajectory, PositionBased, tip_goal
from vergence.control.situation import Situation
from vergence.control.solvers import (
    Problem,
    QuadraticProgram,
    Setting,
    Solution,
    Solver,
    describe,
)
from vergence.control.solvers.solver import AT_TIP, NO_FACES, NO_FEATURES, NO_JOINTS
from vergence.estimation.feature_faces import FeatureFaces
from vergence.robot import Arm
from vergence.signals import JointCommand, JointState, Observation, Reference, Setpoint

_ONSET_S = 0.5  # to start the motion of redundant joints within their acceleration limits
_EVERY_DIRECTION = np.eye(6)  # H of ½ ‖v_tip - twist‖²
_HELD_BACK = 1e-3  # m/s and rad/s of the desired twist that are not reached


class PoseServo:
    """Executes one position-based objective: a goal per image, joint rates at the inner rate.

    Between images a trajectory leads the arm's tip to the goal, see `PoseTrajectory`; if limits
    hold the tip back, the trajectory continues from the tip's pose.

    Args:
        arm: up to its tip: the camera, the link that carries it, or the link that holds the target.
        mounting: of the camera.
        objective: the settings of the trajectory.
        limits: to enforce; the defaults of `Limits` if None and the solver enforces limits.
        solver: the quadratic program if None.
        corners: of the target, (M, 3), m, that must stay in view; None for none.
        faces: with the corners; None if unknown.
        situation: further data; its period is the inner one.
    """

    def __init__(
        self,
        arm: Arm,
        mounting: CameraMounting,
        objective: PositionBased,
        *,
        limits: Limits | None = None,
        solver: Solver | None = None,
        corners: FloatArray | None = None,
        faces: FeatureFaces | None = None,
        situation: Situation,
    ) -> None:
        self._arm, self._mounting, self._situation = arm, mounting, situation
        self._limits = arm.limits
        setting = Setting(
            arm, mounting, limits, situation.period_s, situation.obstacles,
            situation.depth_range, situation.start, situation.clearance,
        )  # fmt: skip
        self._solver = (QuadraticProgram() if solver is None else solver).bind(setting)
        self._trajectory = PoseTrajectory(objective, arm, situation.period_s)
        self._null_space_rate = objective.null_space_rate
        self._null_space = np.zeros(arm.joint_count)  # rates of redundant joints, started smoothly
        self._view: TargetView | None = None
        if corners is not None and self._solver.keeps_limits:
            self._view = TargetView(mounting, corners, *self._solver.view, faces)
        count = len(self._solver.names)
        self._active, self._slack, self._solved = np.zeros(count), np.zeros(count), True

    def take_over(self, previous: object) -> bool:
        """Continue the trajectory of another servo of this kind; return whether it is one."""
        if not isinstance(previous, PoseServo):
            return False
        self._trajectory.take_over(previous._trajectory)
        self._null_space = previous._null_space
        return True

    def command(
        self, observation: Observation, reference: Reference, joints: JointState
    ) -> JointCommand:
        """Set the goal from the target's new pose; return the initial rates."""
        target, desired = observation.target, reference.T_camera_target
        if target is None or desired is None:
            self.hold()
            return JointCommand(np.zeros(self._arm.joint_count), np.zeros(6))
        motion = self._situation.motion
        goal = tip_goal(target, desired, self._mounting, joints.time if motion.prediction else None)
        if motion.feed_forward is False:
            goal = MovingPose(goal.T, np.zeros(6))
        self._trajectory.aim(goal, joints.position)
        if self._view is not None:
            self._view.see(target, desired, joints.time)
        pressure = describe(self._active, self._slack, self._solved, self._solver.names)
        self._active, self._slack, self._solved = 0 * self._active, 0 * self._slack, True
        now = Setpoint(joints.position.copy(), joints.velocity.copy())
        solution = self._solve(now, self._trajectory.twist(joints.position))
        A = self._twist_map(joints.position)
        return JointCommand(
            solution.rates,
            solution.v_tip if len(A) == 0 else A @ solution.v_tip,
            solution.manipulability,
            solution.penalty,
            pressure.active,
            solution.fault,
            slack=pressure.slack,
            clearance=solution.clearance,
        )

    def follow(self, setpoint: Setpoint) -> FloatArray:
        """Return joint rates (n,) for the next inner period from the last set-point."""
        if not self._trajectory.planned:
            return np.zeros(self._arm.joint_count)
        twist = self._trajectory.next_twist(setpoint.position)
        solution = self._solve(setpoint, twist)
        differs = bool(np.abs(solution.v_tip - twist).max() > _HELD_BACK)
        held_back = self._solver.keeps_limits and differs
        self._trajectory.advance(setpoint.position, solution.rates, held_back)
        if self._view is not None:
            self._view.advance(self._situation.period_s)
        return solution.rates

    def hold(self) -> None:
        """Clear the goal and the trajectory."""
        self._trajectory.clear()
        self._null_space = np.zeros(self._arm.joint_count)

    def _solve(self, joints: Setpoint, twist: FloatArray) -> Solution:
        features, faces = NO_FEATURES, None
        if self._view is not None:
            T_world_tip = self._arm.forward_kinematics(joints.position)
            features, faces = self._view.features(T_world_tip), self._view.faces(T_world_tip)
        problem = Problem(
            joints.position,
            joints.velocity,
            _EVERY_DIRECTION,
            twist,
            features,
            self._null_space_rates(joints.position),
            *NO_JOINTS,
            self._twist_map(joints.position),
            faces=NO_FACES if faces is None else faces,
            surface_known=faces is not None,
        )
        solution = self._solver.solve(problem)
        self._active = np.maximum(self._active, solution.active)
        self._slack = np.maximum(self._slack, solution.slack)
        self._solved = self._solved and solution.solved
        return solution

    def _twist_map(self, q: FloatArray) -> FloatArray:
        """Return A (6, 6) with v_camera = A v_tip; (0, 0) for a camera at the tip."""
        if self._mounting.at_tip:
            return AT_TIP
        return self._mounting.twist_map(self._arm.forward_kinematics(q))

    def _null_space_rates(self, q: FloatArray) -> FloatArray:
        """Return the rates of redundant joints towards mid-range, (n,), started smoothly."""
        share = self._situation.period_s / _ONSET_S
        self._null_space = nearer_to_middle(
            self._null_space, q, self._limits, self._null_space_rate, share
        )
        return self._null_space


@njit(cache=True, error_model="numpy")
def nearer_to_middle(
    before: FloatArray, q: FloatArray, limits: FloatArray, rate: float, share: float
) -> FloatArray:
    """Return rates (n,) that have come by a share nearer to those towards the middle of the range.

    Args:
        before: the rates of the period before, (n,).
        q: joint positions, (n,).
        limits: rows q_min, q_max and others, (k, n); without both, a joint has no middle.
        rate: from an end of the range, rad/s or m/s.
        share: from 0 to 1.
    """
    rates = np.empty(len(q))
    for i in range(len(q)):
        low, high, towards = limits[0, i], limits[1, i], 0.0
        if np.isfinite(high - low):
            towards = -rate * (2.0 * q[i] - low - high) / (high - low)
        rates[i] = before[i] + share * (towards - before[i])
    return rates
