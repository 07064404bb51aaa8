"""The driver for that robot: what the loop asks of a cell, answered over a socket."""

import os
import socket
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from time import monotonic
from typing import Any

from link import LinkBrokenError, connect
from messages import encode, read_image, read_said

from vergence.arrays import FloatArray
from vergence.camera import Camera
from vergence.errors import DriverSilent
from vergence.robot import Arm
from vergence.runtime.hardware import JointHistory, VideoCamera
from vergence.signals import Frame, Sample, Setpoint

_LONGEST = 1 << 26  # bytes of a message of the robot: an image of the largest camera


class SocketDriver:
    """Reaches `robot.py`; its cameras may hang on the robot or on this computer.

    Raises:
        DriverSilent: from every method, within `timeout_s`, if the robot says nothing, hangs up,
            refuses, or says what cannot be understood.
    """

    def __init__(
        self,
        address: tuple[str, int],
        arms: Mapping[str, Arm],
        cameras: Mapping[str, Camera],
        inner_rate_hz: float,
        timeout_s: float = 2.0,
    ) -> None:
        self.arms, self.cameras, self.inner_rate_hz = arms, cameras, inner_rate_hz
        self.videos: Sequence[VideoCamera] = ()  # cameras on this computer
        self._timeout_s = timeout_s
        self._history = {name: JointHistory() for name in arms}
        self._frames: list[Frame] = []
        self._period = 0
        self._link = connect(address, _LONGEST)
        self._send({"client": f"{socket.gethostname()}, process {os.getpid()}"[:100]})
        self._receive()

    def read(self) -> Sample:
        """Return joints as the robot said last, and the images since the last call."""
        frames, self._frames = self._frames, []
        for video in self.videos:
            frames.extend(video.frames(self._joints_at))
        return Sample(self.time, self._joints, tuple(frames))

    def step(self, setpoints: Mapping[str, Setpoint]) -> None:
        """Send set-points and wait for the robot's next period: its clock is the loop's."""
        told = {n: [s.position.tolist(), s.velocity.tolist()] for n, s in setpoints.items()}
        self._send({"period": self._period, "setpoints": told})
        self._receive()

    def close(self) -> None:
        """Let go; the robot's watchdog stops the arm if it still moves."""
        for video in self.videos:
            video.close()
        self._link.close()

    def _send(self, words: dict[str, Any]) -> None:
        with self._hangs_up():
            self._link.send([encode(words)], self._timeout_s)

    def _receive(self) -> None:
        """Take joints and images as the robot says them."""
        deadline = monotonic() + self._timeout_s
        with self._hangs_up():
            said = read_said(self._next(deadline), self.arms)
            self._period, self.time, self._joints, _ = said
            for name, state in said.joints.items():
                self._history[name].add(state)
            for about in said.images:
                camera, time, image = read_image(about, self._next(deadline), self.cameras)
                self._frames.append(Frame(camera, time, image, self._joints_at(time)))

    def _next(self, deadline: float) -> bytes:
        message = self._link.receive(max(deadline - monotonic(), 0.0))
        if message is None:
            raise LinkBrokenError(f"said nothing for {self._timeout_s:g} s")
        return message

    @contextmanager
    def _hangs_up(self) -> Iterator[None]:
        """Hang up where the link breaks."""
        try:
            yield
        except LinkBrokenError as error:
            self._link.close()
            raise DriverSilent(f"the robot {error}") from error

    def _joints_at(self, time: float) -> dict[str, FloatArray]:
        return {name: history.at(time) for name, history in self._history.items()}
