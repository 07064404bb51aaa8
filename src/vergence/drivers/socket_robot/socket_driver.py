"""The client's side of a robot behind a socket."""

import os
import socket
from collections.abc import Mapping
from time import monotonic
from typing import Any

from vergence.arrays import FloatArray
from vergence.drivers.controller_clock import ControllerClock
from vergence.drivers.equipment import Equipment
from vergence.drivers.local_cameras import LocalCameras
from vergence.drivers.socket_robot.link import Link, LinkBrokenError
from vergence.drivers.socket_robot.messages import encode, read_image, read_said
from vergence.errors import DriverSilent
from vergence.runtime.hardware import JointHistory
from vergence.signals import Frame, RobotState, Sample, Setpoint

_RATE_TOLERANCE = 0.05  # of the robot's period against the cell's


class SocketDriver:
    """Answers the loop with what a robot says over a link, and sends it set-points.

    Args:
        link: to the robot.
        equipment: of the cell; cameras without a source are the robot's.
        timeout_s: how long the robot may say nothing.
        peer: what is at the other end of the link, for messages.
        rate_is_known: whether `equipment` has the robot's own rate, which then needs no check.

    Raises:
        DriverSilent: from every method, within `timeout_s`, if the robot says nothing, hangs up,
            refuses, or says what cannot be understood.
    """

    def __init__(
        self,
        link: Link,
        equipment: Equipment,
        timeout_s: float = 2.0,
        peer: str = "the robot",
        rate_is_known: bool = False,
    ) -> None:
        self.arms, self.cameras = equipment.arms, equipment.cameras
        self.inner_rate_hz = equipment.inner_rate_hz
        self._timeout_s, self._peer = timeout_s, peer
        self._history = {name: JointHistory() for name in self.arms}
        self._frames: list[Frame] = []
        self._robots: dict[str, RobotState] = {}  # of the arms that report it
        self.outputs: tuple[str, ...] = ()  # names of those that the robot has
        self._to_set: dict[str, float] = {}  # outputs, with the next answer
        self._first = 0, 0.0  # period and time of the first message
        self._rate_is_known = rate_is_known
        self._period, self._time = 0, 0.0
        self._clock: ControllerClock | None = None
        self._link = link
        try:
            self._send({"client": f"{socket.gethostname()}, process {os.getpid()}"[:100]})
            self._receive()
            self._local = LocalCameras(equipment.sources, self._now)
        except BaseException:
            link.close()
            raise

    def read(self) -> Sample:
        """Return joints as the robot said last, and the images since the last call."""
        frames, self._frames = self._frames, []
        frames.extend(self._local.frames(self._joints_at, self._time))
        return Sample(self._time, self._joints, tuple(frames), self._robots)

    def step(self, setpoints: Mapping[str, Setpoint]) -> None:
        """Send set-points and wait for the robot's next period: its clock is the loop's."""
        told = {n: [s.position.tolist(), s.velocity.tolist()] for n, s in setpoints.items()}
        self._send(self._answer(told))
        self._receive()

    def set_output(self, name: str, value: float) -> None:
        """Set an output of the robot with the next set-points."""
        self._to_set[name] = value

    def close(self) -> None:
        """Let go; the robot's watchdog stops the arm if it still moves."""
        self._local.close()
        self._link.close()

    def _answer(self, setpoints: Mapping[str, Any]) -> dict[str, Any]:
        """Return the answer to the last period: set-points, and the outputs to be set."""
        outputs, self._to_set = self._to_set, {}
        answer = {"period": self._period, "setpoints": setpoints}
        return answer | {"outputs": outputs} if outputs else answer

    def _send(self, words: dict[str, Any]) -> None:
        try:
            self._link.send([encode(words)], self._timeout_s)
        except LinkBrokenError as error:
            raise self._silent(self._refusal() or error) from error

    def _refusal(self) -> LinkBrokenError | None:
        """Return why a robot that has hung up refuses, if it said so before."""
        while True:
            try:
                message = self._link.receive(0.0)
            except LinkBrokenError:
                return None
            if message is None:
                return None
            try:
                read_said(message, self.arms)
            except LinkBrokenError as error:
                if error.refused:
                    return error

    def _receive(self) -> None:
        """Wait for the joints, states and images of one period."""
        deadline = monotonic() + self._timeout_s
        try:
            self._take(self._next(deadline), deadline)
        except LinkBrokenError as error:
            raise self._silent(error) from error

    def _receive_what_came(self) -> None:
        """Take the periods that are here already, without waiting."""
        deadline = monotonic() + self._timeout_s
        try:
            while (message := self._link.receive(0.0)) is not None:
                self._take(message, deadline)
        except LinkBrokenError as error:
            raise self._silent(error) from error

    def _take(self, message: bytes, deadline: float) -> None:
        """Take a period; its images are still to come."""
        said = read_said(message, self.arms)
        self._period, self._time = said.period, said.time
        self._joints, self._robots, self.outputs = said.joints, said.robots, said.outputs
        self._note()
        for about in said.images:
            block = self._next(deadline)
            camera, exposed, image = read_image(about, block, self.cameras)
            self._frames.append(Frame(camera, exposed, image, self._joints_at(exposed)))

    def _silent(self, error: LinkBrokenError) -> DriverSilent:
        """Return what a broken link means."""
        return DriverSilent(f"{self._peer} {error}")

    def _next(self, deadline: float) -> bytes:
        message = self._link.receive(max(deadline - monotonic(), 0.0))
        if message is None:
            raise DriverSilent(f"{self._peer} said nothing for {self._timeout_s:g} s")
        return message

    def _note(self) -> None:
        """Take note of joints and time."""
        for name, state in self._joints.items():
            self._history[name].add(state)
        if self._clock is None:
            self._clock = ControllerClock(self._time)
            self._first = self._period, self._time
        self._clock.hear(self._time)
        if not self._rate_is_known:
            self._check_rate(self._period - self._first[0], self._time - self._first[1])

    def _check_rate(self, periods: int, elapsed: float) -> None:
        """Refuse a robot whose period is not the cell's: set-points would be too fast or slow."""
        if periods <= 0 or elapsed <= 0.0:
            return
        self._rate_is_known, rate_hz = True, periods / elapsed
        if abs(self.inner_rate_hz / rate_hz - 1.0) > _RATE_TOLERANCE:
            raise DriverSilent(
                f"the robot runs at {rate_hz:.4g} Hz and the cell at {self.inner_rate_hz:g} Hz: "
                f"set the cell's inner_rate_hz to {rate_hz:.4g}"
            )

    def _joints_at(self, time: float) -> dict[str, FloatArray]:
        return {name: history.at(time) for name, history in self._history.items()}

    def _now(self) -> float:
        assert self._clock is not None
        return self._clock.now()
