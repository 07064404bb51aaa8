"""Joint rates along a planned motion, at the inner rate."""

from vergence.arrays import FloatArray
from vergence.control.mounting import CameraMounting
from vergence.planning.straight_line import StraightLine
from vergence.robot import Arm
from vergence.signals import JointCommand, JointState, Observation, Reference, Setpoint

_GAIN = 5.0  # 1/s, at which set-points converge to the motion


class AlongLine:
    """Follows a timed motion, which pauses while the arm is held.

    q̇ = Δq_line/Δt + k (q_line - q), with q the last set-point: a start next to the line, by as
    much as a servo lags, is corrected smoothly.

    Args:
        arm: up to its tip.
        mounting: of the task's camera.
        line: the motion.
        period_s: of the set-points.
    """

    def __init__(
        self, arm: Arm, mounting: CameraMounting, line: StraightLine, period_s: float
    ) -> None:
        self._arm, self._mounting, self._line, self._period_s = arm, mounting, line, period_s
        self._time = 0.0  # s, along the line

    @property
    def done(self) -> bool:
        """Whether the end of the line has been requested."""
        return self._time >= self._line.duration

    def command(
        self, observation: Observation, reference: Reference, joints: JointState
    ) -> JointCommand:
        """Return the rates now."""
        _, rates = self._line.joints(self._time)
        A = self._mounting.twist_map(self._arm.forward_kinematics(joints.position))
        return JointCommand(rates, A @ self._arm.jacobian(joints.position) @ rates)

    def follow(self, setpoint: Setpoint) -> FloatArray:
        """Return joint rates (n,) for the next inner period from the last set-point."""
        before, _ = self._line.joints(self._time)
        self._time += self._period_s
        after, _ = self._line.joints(self._time)
        rates: FloatArray = (after - before) / self._period_s
        return rates + _GAIN * (before - setpoint.position)

    def hold(self) -> None:
        """Prepare to continue from the present set-points."""
