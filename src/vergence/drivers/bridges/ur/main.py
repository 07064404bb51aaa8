"""The bridge's main program, started by the driver."""

import signal
from threading import Event, Thread
from time import monotonic, sleep
from typing import TYPE_CHECKING, Any

from ..exchange import Exchange
from ..serve import serve
from ..wire import Wire
from .gone_error import GoneError

if TYPE_CHECKING:
    from .robot import Robot

_POLL_S = 2e-4
_FAREWELL_S = 2.0  # for the driver to read why the bridge ends


class Bridge:
    """Hands the driver's set-points to the robot, and the robot's joints to the driver.

    A driver that is silent is the business of the robot's watchdog, since set-points are passed on
    as they come. Once the driver has hung up, the arm is stopped.

    Args:
        wire: to the driver.
        robot: that is connected.
        settings: of the driver.
    """

    def __init__(self, wire: Wire, robot: "Robot", settings: dict[str, Any]) -> None:
        self._wire, self._robot, self._period_s = wire, robot, 1.0 / settings["rate_hz"]
        self._exchange = Exchange(wire, settings["arm"], settings["outputs"])
        self._gone, self.reason = Event(), ""  # why it ends

    def serve(self) -> None:
        """Work until the driver is gone, or the robot is; then stop the arm."""
        Thread(target=self._listen, daemon=True).start()
        due = monotonic()
        while not self._gone.is_set() and not self.reason:
            if (left := due - monotonic() - _POLL_S) > 0.0:
                sleep(left)
            if self._tell():
                due = monotonic() + self._period_s
            else:
                sleep(_POLL_S)
        if self.reason:
            self._wire.send({"refused": self.reason})
        self._robot.close()
        if self.reason:
            self._gone.wait(_FAREWELL_S)

    def stop(self, *_: Any) -> None:
        """End from a signal."""
        self.reason = "the bridge was told to end"

    def _tell(self) -> bool:
        """Send the robot's joints if there are new ones."""
        try:
            joints = self._robot.read()
        except GoneError as error:
            self.reason = self.reason or str(error)
            return False
        if joints is not None:
            self._exchange.joints(joints, [self._robot.mode, self._robot.scale])
        return joints is not None

    def _listen(self) -> None:
        while (words := self._wire.receive()) is not None:
            if "period" not in words:
                continue
            try:
                for name, value in words.get("outputs", {}).items():
                    self._robot.set_output(name, value)
                for position, rates in words["setpoints"].values():
                    self._robot.send(position, rates)
            except GoneError as error:
                self.reason = self.reason or str(error)
            self._exchange.answered(words["period"])
        self._gone.set()


def main(descriptor: int) -> None:
    """Serve the driver at the other end of a socket."""
    serve(descriptor, _robot, _work)


def _robot() -> "type[Robot]":
    from .robot import Robot

    return Robot


def _work(wire: Wire, settings: dict[str, Any], robot_of: "type[Robot]") -> None:
    try:
        robot = robot_of(settings)
    except GoneError as error:
        wire.send({"refused": str(error)})
        return
    wire.send({"rate_hz": settings["rate_hz"]})
    bridge = Bridge(wire, robot, settings)
    signal.signal(signal.SIGTERM, bridge.stop)
    bridge.serve()
