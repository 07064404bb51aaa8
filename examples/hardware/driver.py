"""The driver for that robot: what the loop asks of a cell, answered over a socket."""

import os
import socket
from collections.abc import Mapping, Sequence
from time import monotonic, sleep
from typing import Any

import numpy as np
from link import Link, LinkBrokenError, decode, encode, vector

from vergence.arrays import FloatArray
from vergence.camera import Camera
from vergence.errors import DriverSilent
from vergence.robot import Arm
from vergence.runtime.hardware import JointHistory, VideoCamera
from vergence.signals import Frame, JointState, Sample, Setpoint

_LONGEST = 1 << 26  # bytes of a message of the robot: an image of the largest camera


def connect(address: tuple[str, int], within_s: float = 30.0) -> Link:
    """Return the link to a robot that may still be starting."""
    until = monotonic() + within_s
    while True:
        try:
            return Link(socket.create_connection(address, within_s), _LONGEST)
        except OSError as error:
            if monotonic() > until:
                raise DriverSilent(f"nobody listens at {address[0]}:{address[1]}") from error
            sleep(0.1)


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
        self.time = 0.0  # s, of the robot's clock
        self._link = connect(address)
        try:
            self._send({"client": f"{socket.gethostname()}, process {os.getpid()}"[:100]})
            self._receive()
        except DriverSilent:
            self._link.close()
            raise

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
        try:
            self._link.send([encode(words)], self._timeout_s)
        except LinkBrokenError as error:
            raise DriverSilent(f"the robot {error}") from error

    def _receive(self) -> None:
        deadline = monotonic() + self._timeout_s
        try:
            self._take(decode(self._next(deadline)), deadline)
        except LinkBrokenError as error:
            raise DriverSilent(f"the robot {error}") from error

    def _take(self, words: dict[str, Any], deadline: float) -> None:
        """Take joints and images as the robot says them."""
        if "refused" in words:
            raise DriverSilent(f"the robot refuses: {str(words['refused'])[:200]}")
        period, joints, images = (words.get(key) for key in ("period", "joints", "images"))
        known = isinstance(joints, dict) and joints.keys() == self.arms.keys()
        if type(period) is not int or not known or not isinstance(images, list):
            raise LinkBrokenError("sends something else than joints and images")
        self._period, (self.time,) = period, vector([words.get("time")], 1)
        self._joints = {name: self._state(joints[name], arm) for name, arm in self.arms.items()}
        for name, state in self._joints.items():
            self._history[name].add(state)
        for about in images:
            self._frames.append(self._frame(about, self._next(deadline)))

    def _state(self, values: Any, arm: Arm) -> JointState:
        if not isinstance(values, list) or len(values) != 2:
            raise LinkBrokenError("sends something else than positions and rates")
        position, velocity = (np.array(vector(part, arm.joint_count)) for part in values)
        return JointState(self.time, position, velocity)

    def _frame(self, about: Any, block: bytes) -> Frame:
        camera = self.cameras.get(about[0]) if isinstance(about, list) and len(about) == 2 else None
        if camera is None or len(block) != camera.height * camera.width:
            raise LinkBrokenError("sends an image of another camera, or of another size")
        (exposed,) = vector(about[1:], 1)
        image = np.frombuffer(block, np.uint8).reshape(camera.height, camera.width)
        return Frame(about[0], exposed, image, self._joints_at(exposed))

    def _next(self, deadline: float) -> bytes:
        message = self._link.receive(max(deadline - monotonic(), 0.0))
        if message is None:
            raise DriverSilent(f"the robot said nothing for {self._timeout_s:g} s")
        return message

    def _joints_at(self, time: float) -> dict[str, FloatArray]:
        return {name: history.at(time) for name, history in self._history.items()}
