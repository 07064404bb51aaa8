"""The driver for that robot: what the loop asks of a cell, answered over a socket."""

import json
from collections.abc import Mapping, Sequence
from multiprocessing.connection import Client, Connection
from time import monotonic, sleep

import numpy as np

from vergence.arrays import FloatArray
from vergence.camera import Camera
from vergence.errors import DriverSilent
from vergence.robot import Arm
from vergence.runtime.hardware import JointHistory, VideoCamera
from vergence.signals import Frame, JointState, Sample, Setpoint


def connect(address: tuple[str, int], within_s: float = 30.0) -> Connection:
    """Return the link to a robot that may still be starting."""
    until = monotonic() + within_s
    while True:
        try:
            return Client(address)
        except ConnectionRefusedError as error:
            if monotonic() > until:
                raise DriverSilent(f"nobody listens at {address[0]}:{address[1]}") from error
            sleep(0.1)


class SocketDriver:
    """Reaches `robot.py`; its cameras may hang on the robot or on this computer."""

    def __init__(
        self,
        address: tuple[str, int],
        arms: Mapping[str, Arm],
        cameras: Mapping[str, Camera],
        inner_rate_hz: float,
        patience_s: float = 2.0,
    ) -> None:
        self.arms, self.cameras, self.inner_rate_hz = arms, cameras, inner_rate_hz
        self.videos: Sequence[VideoCamera] = ()  # cameras on this computer
        self._patience_s = patience_s
        self._history = {name: JointHistory() for name in arms}
        self._frames: list[Frame] = []
        self._period = 0
        self.time = 0.0  # s, of the robot's clock
        self._link = connect(address)
        self._receive()

    def read(self) -> Sample:
        """Return joints as the robot said last, and the pictures since the last call."""
        frames, self._frames = self._frames, []
        for video in self.videos:
            frames.extend(video.frames(self._joints_at))
        return Sample(self.time, self._joints, tuple(frames))

    def step(self, setpoints: Mapping[str, Setpoint]) -> None:
        """Send set-points and wait for the robot's next period: its clock is the loop's."""
        told = {n: [s.position.tolist(), s.velocity.tolist()] for n, s in setpoints.items()}
        words = {"period": self._period, "setpoints": told}
        try:
            self._link.send_bytes(json.dumps(words).encode())
        except OSError as error:
            raise DriverSilent(f"the robot is gone: {error.strerror}") from error
        self._receive()

    def close(self) -> None:
        """Let go; the robot's watchdog stops the arm if it still moves."""
        for video in self.videos:
            video.close()
        self._link.close()

    def _receive(self) -> None:
        words = json.loads(self._next_block())
        self._period, self.time = words["period"], words["time"]
        self._joints = {
            name: JointState(self.time, np.array(position), np.array(velocity))
            for name, (position, velocity) in words["joints"].items()
        }
        for name, state in self._joints.items():
            self._history[name].add(state)
        for camera, exposed, shape in words["pictures"]:
            image = np.frombuffer(self._next_block(), np.uint8).reshape(shape)
            self._frames.append(Frame(camera, exposed, image, self._joints_at(exposed)))

    def _next_block(self) -> bytes:
        try:
            if not self._link.poll(self._patience_s):
                raise DriverSilent(f"the robot said nothing for {self._patience_s:g} s")
            return self._link.recv_bytes()
        except (EOFError, OSError) as error:
            raise DriverSilent("the robot has hung up") from error

    def _joints_at(self, time: float) -> dict[str, FloatArray]:
        return {name: history.at(time) for name, history in self._history.items()}
