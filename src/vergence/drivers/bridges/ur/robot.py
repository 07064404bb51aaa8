"""The real-time connection to a robot of Universal Robots, through ur_rtde."""

from contextlib import suppress
from threading import Lock, Thread
from time import monotonic
from typing import Any

import rtde_control
import rtde_io
import rtde_receive

from ..joints import Joints
from .gone_error import GoneError

_BROKEN = "the connection to the robot is broken: check its cable"
_RUNNING = 7  # of the robot's modes: brakes released, power on
_SAFE = (1, 2)  # of the safety modes: normal, reduced
_PROTECTIVE = (3, 4, 5)  # protective stop, recovery, safeguard stop: they can be cleared
_TEACH_BUTTON = 1 << 2  # of the status bits: the button for free drive on the pendant
_SLOWEST = 0.01  # of the speed slider; below it the robot is taken for stopped
_ON = 0.5  # of an output's value, 0 to 1
_HELD_UP_S = 0.1  # between two looks at the clock: a delay of a busy computer is no stopped robot
_SENT_S = 1.0  # in which a set-point is passed on, or never


class Robot:
    """Sends set-points as `speedJ` or `servoJ`, and reads joints, modes and the speed slider.

    The robot scales speeds by its slider. The loop scales its set-points likewise, so `speedJ` is
    told the speed before scaling. After a protective stop that was cleared on the pendant, the
    control program is started again; until it runs, the robot counts as stopped.

    ur_rtde reconnects in a thread of its own, and whoever calls it meanwhile may crash: therefore
    it has this process to itself.

    Args:
        settings: of the driver.
    """

    def __init__(self, settings: dict[str, Any]) -> None:
        self._settings = settings
        self._acceleration = max(settings["acceleration_max"])
        self._sending = self._halted = self._closed = False
        self._starting: Thread | None = None
        self._commanding = Lock()
        self._time = self._stood_s = 0.0
        self._asked = monotonic()
        address, rate_hz = settings["address"], settings["rate_hz"]
        try:
            self._receive: Any = rtde_receive.RTDEReceiveInterface(address, rate_hz)
            self._control: Any = rtde_control.RTDEControlInterface(address, rate_hz)
            if settings["outputs"]:
                self._io: Any = rtde_io.RTDEIOInterface(address)
        except RuntimeError as error:
            raise GoneError(_explained(str(error), address)) from error
        self.mode, self.scale = "running", 1.0

    def read(self) -> Joints | None:
        """Return the joints if they are newer than those before.

        Raises:
            GoneError: if the connection is broken, or the robot's clock does not advance.
        """
        receive = self._receive
        if not receive.isConnected():
            raise GoneError(_BROKEN)
        time, now = receive.getTimestamp(), monotonic()
        self._stood_s += min(now - self._asked, _HELD_UP_S)
        self._asked = now
        if time == self._time:
            if self._stood_s > self._settings["timeout_s"]:
                silent_s = self._settings["timeout_s"]
                raise GoneError(f"the controller's clock has not advanced for {silent_s:g} s")
            return None
        self._time, self._stood_s = time, 0.0
        self.scale = min(max(float(receive.getTargetSpeedFraction()), 0.0), 1.0)
        self.mode = self._mode()
        return Joints(time, receive.getActualQ(), receive.getActualQd())

    def send(self, position: list[float], rates: list[float]) -> None:
        """Hand on a set-point; the first one arms the robot's watchdog.

        Raises:
            GoneError: if the connection is broken.
        """
        if self.mode != "running":
            self._halted = True
            return
        with self._commanding:
            if self._closed:
                return
            if not self._control.isConnected():  # a call would wait until it has reconnected
                raise GoneError(_BROKEN)
            try:
                self._hand_on(position, rates)
            except RuntimeError as error:
                raise GoneError(_BROKEN) from error

    def set_output(self, name: str, value: float) -> None:
        """Switch a digital output on from a half on, or off.

        Raises:
            GoneError: if the robot does not take it.
        """
        kind, _, number = self._settings["outputs"][name].partition(" ")
        switch = {
            "standard": self._io.setStandardDigitalOut,
            "configurable": self._io.setConfigurableDigitalOut,
            "tool": self._io.setToolDigitalOut,
        }[kind]
        try:
            taken = switch(int(number), value >= _ON)
        except RuntimeError as error:
            raise GoneError(_BROKEN) from error
        if not taken:
            raise GoneError(f"the robot does not take output {name}, its digital output {number}")

    def close(self) -> None:
        """Stop the arm and end the control program."""
        if not self._commanding.acquire(timeout=_SENT_S):
            return
        self._closed = True
        self._commanding.release()
        if (starting := self._starting) is not None:
            starting.join(5.0)
        with suppress(RuntimeError):  # the robot's watchdog stops an arm that cannot be reached
            if self._receive.isConnected() and self._control.isProgramRunning():
                self._control.speedStop(self._acceleration)
                self._control.stopScript()

    def _hand_on(self, position: list[float], rates: list[float]) -> None:
        if self._halted and not self._control.isProgramRunning():
            self._starting = Thread(target=self._start_program, daemon=True)
            self._starting.start()
            return
        if self._halted or not self._sending:
            self._sending = bool(self._control.setWatchdog(self._settings["watchdog_hz"]))
        self._halted = not self._send(position, rates)

    def _send(self, position: list[float], rates: list[float]) -> bool:
        settings, period = self._settings, 1.0 / self._settings["rate_hz"]
        if settings["command"] == "servoj":
            rest = settings["lookahead_s"], float(settings["servo_gain"])
            return bool(self._control.servoJ(position, 0.0, 0.0, period, *rest))
        scale = max(self.scale, _SLOWEST)
        pairs = zip(rates, settings["rate_max"], strict=True)
        unscaled = [min(max(rate / scale, -most), most) for rate, most in pairs]
        return bool(self._control.speedJ(unscaled, self._acceleration, period))

    def _mode(self) -> str:
        receive = self._receive
        safety = receive.getSafetyMode()
        if safety not in _SAFE:
            return "protective stop" if safety in _PROTECTIVE else "emergency stop"
        if receive.getRobotStatus() & _TEACH_BUTTON:
            return "hand-guided"
        halted = self._starting is not None or self.scale < _SLOWEST
        return "protective stop" if receive.getRobotMode() != _RUNNING or halted else "running"

    def _start_program(self) -> None:
        """Start the control program again; it takes a second, so a thread does it."""
        with suppress(RuntimeError):  # it is tried again with the next set-point
            self._control.reuploadScript()
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
