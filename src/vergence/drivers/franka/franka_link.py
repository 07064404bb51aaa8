"""The real-time connection to a robot of Franka."""

from contextlib import suppress
from typing import TYPE_CHECKING, Any

import numpy as np

from vergence.arrays import FloatArray
from vergence.drivers.arm_link import ArmReading
from vergence.errors import DriverSilent
from vergence.robot import Arm
from vergence.signals import RobotMode, RobotState, Setpoint

if TYPE_CHECKING:
    from vergence.drivers.franka.franka import Franka

_ACCELERATION_SHARE = 0.8  # of the robot's limits: lost states make velocities a little uneven
_UNFILTERED_HZ = 1000.0  # no low-pass filter of libfranka's: motions are smooth, a filter is late
_CLOSED = 0.5  # of an output's value, 0 to 1
_MOST_ABORTED = 3  # motions in succession, of a robot that says that it is well
_MODES = {
    "Idle": RobotMode.RUNNING,
    "Move": RobotMode.RUNNING,
    "Guiding": RobotMode.HAND_GUIDED,
    "UserStopped": RobotMode.EMERGENCY_STOP,
}  # all others, such as a reflex, hold the arm


class FrankaLink:
    """Sends set-points as velocity motions that end at rest, and reads joints and modes.

    franky turns each motion into velocities at 1 kHz in a thread of its own, by limits of velocity,
    acceleration and jerk, from where the last motion has got to. Without a new one the arm brakes.
    If the whole process ends, the robot itself stops: that is its reflex of a broken connection.

    Args:
        franky: the package.
        robot: franky's, connected.
        settings: of the robot.
        arm: with its limits.
        hand: franky's gripper, if the robot's is used.
    """

    def __init__(
        self, franky: Any, robot: Any, settings: "Franka", arm: Arm, hand: Any = None
    ) -> None:
        self._settings, self._hand = settings, hand
        self._closing: Any = None  # what the hand was told last
        self.rate_hz, self.catch_up_s = settings.rate_hz, 0.05
        self._franky, self._robot, self._arm = franky, robot, arm
        self._errors = (franky.Exception, RuntimeError)  # the latter of libfranka's own library
        self._gain = settings.position_gain
        self._aborted = 0  # motions in succession
        self._hold = franky.Duration(round(1e3 * settings.watchdog_s))
        self._rest = franky.JointVelocityWaypoint(np.zeros(arm.joint_count))
        for limit, most, share in (
            (robot.joint_velocity_limit, arm.rate_max, 1.0),
            (robot.joint_acceleration_limit, arm.acceleration_max, _ACCELERATION_SHARE),
            (robot.joint_jerk_limit, np.inf, settings.jerk_share),
        ):
            limit.set(np.minimum(most, share * np.array(limit.max)))
        self._reading = self.read()

    def read(self) -> ArmReading:
        """Return the newest reading."""
        try:
            state = self._robot.state
        except self._errors as error:
            raise DriverSilent(_gone(error)) from error
        mode = _MODES.get(state.robot_mode.name, RobotMode.PROTECTIVE_STOP)
        self._reading = ArmReading(
            state.time.to_sec(), np.array(state.q), np.array(state.dq), RobotState(mode)
        )
        return self._reading

    def send(self, setpoint: Setpoint) -> None:
        """Hand on a set-point; a robot that is stopped takes none."""
        if not self._reading.robot.running:
            return
        franky = self._franky
        target = franky.JointVelocityWaypoint(
            self._rates(setpoint), hold_target_duration=self._hold
        )
        motion = franky.JointVelocityWaypointMotion([target, self._rest])
        try:
            self._robot.move(motion, asynchronous=True, cutoff_frequency=_UNFILTERED_HZ)
            self._aborted = 0
        except franky.ControlException as error:  # of a motion before, such as a reflex
            self._aborted += 1
            if self._aborted > _MOST_ABORTED and self.read().robot.running:
                raise DriverSilent(_gone(error)) from error
        except self._errors as error:
            raise DriverSilent(_gone(error)) from error

    @property
    def outputs(self) -> tuple[str, ...]:
        """The hand's name, if it is used."""
        return (self._settings.gripper,) if self._hand is not None else ()

    def set_output(self, name: str, value: float) -> None:
        """Close the hand from a half on, on whatever is between its fingers, or open it.

        Raises:
            DriverSilent: if the hand does not answer.
        """
        settings, hand = self._settings, self._hand
        speed, force = settings.gripper_speed_m_s, settings.gripper_force_n
        try:
            if value >= _CLOSED:
                self._closing = hand.grasp_async(0.0, speed, force, 0.0, hand.max_width)
            else:
                self._closing = hand.open_async(speed)
        except self._errors as error:
            raise DriverSilent(_gone(error, "the robot's hand")) from error

    def close(self) -> None:
        """Brake the arm and disconnect."""
        with suppress(Exception):  # the robot stops an arm that cannot be reached
            if self._robot.is_in_control:
                self._robot.move(self._franky.JointVelocityStopMotion())
        self._robot = None

    def _rates(self, setpoint: Setpoint) -> FloatArray:
        """Return the joint rates (n,) that keep the arm on its set-points."""
        gap = setpoint.position - self._reading.position
        rates = setpoint.velocity + self._gain * gap
        limited: FloatArray = np.clip(rates, -self._arm.rate_max, self._arm.rate_max)
        return limited


def _gone(error: Exception, what: str = "the robot") -> str:
    text = str(error).removeprefix("libfranka: ").strip()
    return f"{what} does not answer any more: {text}"
