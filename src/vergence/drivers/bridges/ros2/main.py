"""The bridge's main program, started by the driver."""

import signal
from threading import Event, Thread
from time import monotonic, sleep
from typing import TYPE_CHECKING, Any

from ..exchange import Exchange
from ..serve import serve
from ..wire import Wire
from .command import Command

if TYPE_CHECKING:
    from .topics import Topics

_POLL_S = 0.01
_FAREWELL_S = 2.0  # for the driver to read why the bridge ends
_OTHERS_S = 5.0  # in which whoever else commands the arm is discovered, at the latest
_REPEATS = 5  # of the command to rest, since one may get lost


class Bridge:
    """Hands the driver's set-points to the robot, and brakes the arm when none come any more.

    Args:
        wire: to the driver.
        topics: of the robot.
        settings: of the driver.
    """

    def __init__(self, wire: Wire, topics: "Topics", settings: dict[str, Any]) -> None:
        self._wire, self._topics, self._settings = wire, topics, settings
        self._exchange = Exchange(wire, settings["arm"], settings["outputs"])
        self._command: Command | None = None
        self._commanded = monotonic()
        self._gone, self._braking = Event(), Event()
        self._alone_until = monotonic() + _OTHERS_S
        self.reason = ""  # why it ends

    def serve(self) -> None:
        """Work until the driver is gone or silent, or the robot is; then brake the arm."""
        Thread(target=self._listen, daemon=True).start()
        self._topics.heard = monotonic()
        self._topics.on_joints, self._topics.on_image = self._exchange.joints, self._exchange.image
        while not self._gone.wait(_POLL_S) and not self.reason:
            self.reason = self._trouble()
        if self.reason:
            self._wire.send({"refused": self.reason})
        self._brake()
        self._topics.stop()
        self._gone.wait(_FAREWELL_S)

    def stop(self, *_: Any) -> None:
        """End from a signal."""
        self.reason = "the bridge was told to end"

    def _listen(self) -> None:
        while (words := self._wire.receive()) is not None:
            if "period" not in words:
                continue
            for name, value in words.get("outputs", {}).items():
                self._topics.outputs.set(name, value)
            for position, velocity in words["setpoints"].values():
                if not self._braking.is_set():
                    self._command = Command(position, velocity, words.get("twist", []))
                    self._commanded = monotonic()
                    self._topics.publish(self._command)
            self._exchange.answered(words["period"])
        self._gone.set()

    def _trouble(self) -> str:
        """Return why this cannot continue."""
        settings, now = self._settings, monotonic()
        if now - self._topics.heard > settings["timeout_s"]:
            topic, silent = settings["joint_states"], settings["timeout_s"]
            return f"no joint states came on {topic} for {silent:g} s"
        if back := self._topics.joint_states.backwards_s:
            return f"the stamps of {settings['joint_states']} went back by {back:.2g} s"
        if refused := self._topics.outputs.refused:
            return refused
        moving = self._command is not None and self._command.moving
        if moving and now - self._commanded > settings["watchdog_s"]:
            return f"no set-point came for {settings['watchdog_s']:g} s, and the arm was braked"
        return self._topics.others() if now < self._alone_until else ""

    def _brake(self) -> None:
        """Bring the arm to rest at the limits of its accelerations."""
        self._braking.set()
        if (last := self._command) is None or not last.moving:
            return
        whole_s, begun = last.seconds_to_rest(self._settings["acceleration_max"]), monotonic()
        while (elapsed := monotonic() - begun) < whole_s:
            self._topics.publish(last.braked(elapsed, whole_s))
            sleep(1.0 / self._settings["rate_hz"])
        for _ in range(_REPEATS):
            self._topics.publish(last.braked(whole_s, whole_s))
            sleep(_POLL_S)


def main(descriptor: int) -> None:
    """Serve the driver at the other end of a socket."""
    serve(descriptor, _topics, _work)


def _topics() -> "type[Topics]":
    from .topics import Topics

    return Topics


def _work(wire: Wire, settings: dict[str, Any], topics_of: "type[Topics]") -> None:
    topics = topics_of(settings)
    found = topics.found()
    wire.send(found)
    if "refused" in found:
        topics.stop()
    else:
        settings["rate_hz"] = found["rate_hz"]
        bridge = Bridge(wire, topics, settings)
        signal.signal(signal.SIGTERM, bridge.stop)
        bridge.serve()
    topics.leave()
