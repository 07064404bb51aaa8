"""The example of a driver: an arm in another process, reached over a socket."""

import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib import import_module
from multiprocessing.connection import Listener
from pathlib import Path
from threading import Event, Thread

import numpy as np
import pytest

from vergence.cell import load_cell
from vergence.errors import DriverSilent
from vergence.runtime import Recording
from vergence.signals import OutcomeKind
from vergence.simulation import SimulatedDriver

FOLDER = Path(__file__).parents[1] / "examples" / "hardware"
PATIENCE_S = 2.0  # of a machine that has other things to do
SLOW = {"inner_rate_hz": "125"}
CREEPING = "target.motion.velocity_m_s=[0.03, 0, 0]"


@pytest.fixture(scope="module")
def model() -> SimulatedDriver:
    return SimulatedDriver(load_cell("puma560", SLOW), images=False)


@pytest.fixture
def example(monkeypatch: pytest.MonkeyPatch) -> Callable[[str], object]:
    monkeypatch.syspath_prepend(str(FOLDER))
    return import_module


class Noted(SimulatedDriver):
    """Keeps the set-points that reach its servos."""

    def step(self, setpoints) -> None:
        vars(self).setdefault("steps", []).append(setpoints["puma"])
        super().step(setpoints)


class Robot(Thread):
    """The robot of the example, in a thread, so that its arm can be looked at."""

    def __init__(self, example: Callable[[str], object], images: bool, patience_s: float) -> None:
        super().__init__(daemon=True)
        self._serve, self._images, self._patience_s = example("robot").serve, images, patience_s
        self.door, self.ready = Listener(("localhost", 0)), Event()
        self.end = ""
        self.start()
        assert self.ready.wait(60)

    def run(self) -> None:
        self.driver = Noted(load_cell("puma560", SLOW), self._images)
        self.ready.set()
        self.end = self._serve(self.driver, self.door, self._patience_s)
        self.driver.close()
        self.door.close()


def test_over_the_socket_the_arm_moves_as_it_does_directly(
    example: Callable[[str], object], model: SimulatedDriver, tmp_path: Path
) -> None:
    servo, socket_driver = example("servo").servo, example("driver").SocketDriver
    direct = SimulatedDriver(load_cell("puma560", SLOW))
    assert servo(direct, model, 1.5, tmp_path / "direct").succeeded
    direct.close()
    robot = Robot(example, True, PATIENCE_S)
    arms, cameras = model.arms, model.cameras
    driver = socket_driver(robot.door.address, arms, cameras, model.inner_rate_hz, PATIENCE_S)
    assert servo(driver, model, 1.5, tmp_path / "socket").succeeded
    driver.close()
    robot.join(60)
    assert robot.end == "the client is gone; the arm is at rest"
    here, there = (Recording.open(tmp_path / way) for way in ("direct", "socket"))
    expected, actual = here.arms["puma"], there.arms["puma"]
    moved = np.ptp(expected.position, axis=0).max()
    for joint in range(6):
        place = np.interp(expected.time, actual.time, actual.position[:, joint])
        np.testing.assert_allclose(place, expected.position[:, joint], atol=0.05 * moved)


@contextmanager
def moving_client(robot: Robot) -> Iterator[subprocess.Popen[bytes]]:
    """A process that moves the arm, up to speed."""
    command = [sys.executable, "-c", DRIVE, str(robot.door.address[1])]
    with subprocess.Popen(command, stdout=subprocess.PIPE) as client:
        assert client.stdout is not None
        assert client.stdout.readline() == b"moving\n"
        yield client
        client.kill()


def test_an_arm_whose_client_is_killed_brakes_to_rest_within_its_limits(
    example: Callable[[str], object], model: SimulatedDriver
) -> None:
    robot = Robot(example, False, PATIENCE_S)
    with moving_client(robot) as client:
        client.send_signal(signal.SIGKILL)
        robot.join(60)
    assert "the client is gone" in robot.end
    assert_braked(robot.driver, model)


def test_an_arm_whose_client_hangs_brakes_to_rest_within_its_limits(
    example: Callable[[str], object], model: SimulatedDriver
) -> None:
    robot = Robot(example, False, 0.3)
    with moving_client(robot) as client:
        client.send_signal(signal.SIGSTOP)
        robot.join(60)
    assert robot.end == "the client was silent for 0.3 s; the arm is at rest"
    assert_braked(robot.driver, model)


def assert_braked(driver: SimulatedDriver, model: SimulatedDriver) -> None:
    velocity = np.array([setpoint.velocity for setpoint in driver.steps])
    assert np.abs(velocity[:, 0]).max() > 0.2  # it did move
    np.testing.assert_array_equal(velocity[-1], 0.0)
    arm = model.arms["puma"]
    assert (np.abs(np.diff(velocity, axis=0)) <= arm.acceleration_max / 125 + 1e-9).all()
    assert (np.abs(velocity) <= arm.rate_max).all()


# A client that turns the first joint at 0.3 rad/s, with nothing but the messages.
DRIVE = """
import json, sys
from multiprocessing.connection import Client
link = Client(("localhost", int(sys.argv[1])))
first = None
while True:
    words = json.loads(link.recv_bytes())
    q, _ = words["joints"]["puma"]
    first = first or (words["time"], q)
    since = words["time"] - first[0]
    q = [first[1][0] + 0.3 * since, *first[1][1:]]
    answer = {"period": words["period"], "setpoints": {"puma": [q, [0.3, 0, 0, 0, 0, 0]]}}
    link.send_bytes(json.dumps(answer).encode())
    if 0.5 < since < 0.51:
        print("moving", flush=True)
"""


@pytest.fixture
def far_robot() -> Iterator[tuple[subprocess.Popen[str], int]]:
    """The robot in a process of its own, as the example is started."""
    with socket.socket() as free:
        free.bind(("localhost", 0))
        port = free.getsockname()[1]
    with subprocess.Popen(
        [sys.executable, "-W", "error", str(FOLDER / "robot.py"), "puma560", str(port), CREEPING],
        stdout=subprocess.PIPE,
        text=True,
        env={"MUJOCO_GL": "egl"} | os.environ,
    ) as robot:
        assert robot.stdout is not None
        assert robot.stdout.readline() == "ready\n"
        yield robot, port
        robot.kill()


@pytest.mark.parametrize(
    ("how", "reason"),
    [(signal.SIGKILL, "the robot"), (signal.SIGSTOP, "the robot said nothing for 2 s")],
)
def test_a_robot_that_dies_or_hangs_ends_the_run_by_name(
    far_robot: tuple[subprocess.Popen[str], int], how: int, reason: str, tmp_path: Path
) -> None:
    robot, port = far_robot
    servo = subprocess.Popen(
        [sys.executable, "-W", "error", str(FOLDER / "servo.py"), "puma560", str(port)],
        cwd=tmp_path,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    recording = tmp_path / "runs" / "robot-over-a-socket" / "recording.mcap"
    for _ in range(600):
        if recording.is_file() and recording.stat().st_size > 700_000:
            break
        time.sleep(0.1)
    robot.send_signal(how)
    said, error = servo.communicate(timeout=60)
    assert error == ""
    assert "driver silent at" in said
    assert reason in said
    kept = Recording.open(recording.parent)
    assert kept.complete
    assert kept.outcome is not None
    assert kept.outcome.kind is OutcomeKind.DRIVER_SILENT
    assert len(kept.arms["puma"].time) > 10


def test_a_robot_that_never_speaks_is_told_from_the_start(
    example: Callable[[str], object], model: SimulatedDriver
) -> None:
    with Listener(("localhost", 0)) as door, pytest.raises(DriverSilent, match="said nothing"):
        example("driver").SocketDriver(door.address, model.arms, model.cameras, 125.0, 0.1)
