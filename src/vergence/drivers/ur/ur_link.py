"""The real-time connection to a robot of Universal Robots."""

import logging
from contextlib import suppress
from threading import Thread
from typing import TYPE_CHECKING, Any

import numpy as np

from vergence.arrays import FloatArray
from vergence.drivers.arm_link import ArmReading
from vergence.errors import DriverSilent
from vergence.robot import Arm
from vergence.signals import RobotMode, RobotState, Setpoint

if TYPE_CHECKING:
    from vergence.drivers.ur.ur import Ur

_LOG = logging.getLogger(__name__)
_UNPLUGGED = "the connection to the robot is broken: check its cable"
_RUNNING = 7  # of the robot's modes: brakes released, power on
_SAFE = (1, 2)  # of the safety modes: normal, reduced
_PROTECTIVE = (3, 4, 5)  # protective stop, recovery, safeguard stop: they can be cleared
_TEACH_BUTTON = 1 << 2  # of the status bits: the button for free drive on the pendant
_SLOWEST = 0.01  # of the speed slider; below it the robot is taken for stopped


class UrLink:
    """Sends set-points as `speedJ` or `servoJ`, and reads joints, modes and the speed slider.

    The robot scales speeds by its slider. The loop scales its set-points likewise, so `speedJ` is
    told the speed before scaling. After a protective stop that was cleared on the pendant, the
    control program is started again; until it runs, the robot counts as stopped.

    Args:
        settings: of the robot.
        arm: with its limits.
    """

    def __init__(self, settings: "Ur", arm: Arm) -> None:
        import rtde_control
        import rtde_receive

        self.rate_hz = settings.rate_hz
        self.catch_up_s = 0.05 if settings.command == "speedj" else 0.0
        self._settings, self._arm = settings, arm
        self._acceleration = float(arm.acceleration_max.max())
        self._sending = self._halted = False
        self._starting: Thread | None = None
        address = settings.address
        try:
            self._receive: Any = rtde_receive.RTDEReceiveInterface(address, settings.rate_hz)
            self._control: Any = rtde_control.RTDEControlInterface(address, settings.rate_hz)
        except RuntimeError as error:
            raise DriverSilent(_explained(str(error), address)) from error
        self._reading = self._read()

    def read(self) -> ArmReading:
        """Return the newest reading."""
        self._reading = self._read()
        return self._reading

    def send(self, setpoint: Setpoint) -> None:
        """Hand on a set-point; the first one arms the robot's watchdog."""
        if not self._reading.robot.running:
            self._halted = True
            return
        if not self._control.isConnected():  # it is not to be used while it reconnects
            raise DriverSilent(_UNPLUGGED)
        try:
            self._hand_on(setpoint)
        except RuntimeError as error:
            raise DriverSilent(_UNPLUGGED) from error

    def close(self) -> None:
        """Stop the arm, end the control program and disconnect."""
        if (starting := self._starting) is not None:
            starting.join(5.0)
        with suppress(RuntimeError):  # the robot's watchdog stops an arm that cannot be reached
            if self._receive.isConnected() and self._control.isProgramRunning():
                self._control.speedStop(self._acceleration)
                self._control.stopScript()
            self._control.disconnect()
            self._receive.disconnect()

    def _hand_on(self, setpoint: Setpoint) -> None:
        if self._halted and not self._control.isProgramRunning():
            self._starting = Thread(target=self._start_program, daemon=True)
            self._starting.start()
            return
        if self._halted or not self._sending:
            self._sending = bool(self._control.setWatchdog(self._settings.watchdog_hz))
        self._halted = not self._send(setpoint)

    def _send(self, setpoint: Setpoint) -> bool:
        settings, period = self._settings, 1.0 / self.rate_hz
        if settings.command == "servoj":
            rest = settings.lookahead_s, float(settings.servo_gain)
            return bool(self._control.servoJ(setpoint.position.tolist(), 0.0, 0.0, period, *rest))
        rates = self._rates(setpoint).tolist()
        return bool(self._control.speedJ(rates, self._acceleration, period))

    def _rates(self, setpoint: Setpoint) -> FloatArray:
        """Return the joint rates (n,) that keep the arm on its set-points."""
        gap = setpoint.position - self._reading.position
        rates = setpoint.velocity + self._settings.position_gain * gap
        limited = np.clip(rates, -self._arm.rate_max, self._arm.rate_max)
        slowed: FloatArray = limited / max(self._reading.robot.speed_scale, _SLOWEST)
        return np.clip(slowed, -self._arm.rate_max, self._arm.rate_max)

    def _read(self) -> ArmReading:
        receive = self._receive
        if not receive.isConnected():
            raise DriverSilent(_UNPLUGGED)
        return ArmReading(
            receive.getTimestamp(),
            np.array(receive.getActualQ()),
            np.array(receive.getActualQd()),
            self._robot_state(),
        )

    def _robot_state(self) -> RobotState:
        receive = self._receive
        scale = min(max(float(receive.getTargetSpeedFraction()), 0.0), 1.0)
        safety = receive.getSafetyMode()
        if safety not in _SAFE:
            stop = RobotMode.PROTECTIVE_STOP if safety in _PROTECTIVE else RobotMode.EMERGENCY_STOP
            return RobotState(stop, scale)
        if receive.getRobotStatus() & _TEACH_BUTTON:
            return RobotState(RobotMode.HAND_GUIDED, scale)
        if receive.getRobotMode() != _RUNNING or self._starting is not None or scale < _SLOWEST:
            return RobotState(RobotMode.PROTECTIVE_STOP, scale)
        return RobotState(RobotMode.RUNNING, scale)

    def _start_program(self) -> None:
        """Start the control program again; it takes a second, so a thread does it."""
        try:
            self._control.reuploadScript()
        except RuntimeError as error:
            _LOG.info("the control program does not start: %s", error)
        finally:
            self._starting = None


def _explained(message: str, address: str) -> str:
    """Return what an error of ur_rtde means for its user."""
    if "already in use" in message or "currently in use" in message:
        return (
            f"another client controls the robot at {address}: end it, or disable EtherNet/IP, "
            "PROFINET and other users of the RTDE registers on the teach pendant"
        )
    if "emote control" in message:
        return f"the robot at {address} is not in remote control: choose it on the teach pendant"
    return f"the robot at {address} does not take the connection: {message.strip()}"
