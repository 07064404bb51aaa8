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
from pathlib import Path
from threading import Event, Thread

import numpy as np
import pytest

from vergence.arrays import FloatArray
from vergence.cell import load_cell
from vergence.drivers import Equipment
from vergence.drivers.socket_robot import SocketRobot
from vergence.errors import DriverSilent
from vergence.runtime import Driver, Recording, outputs_of
from vergence.signals import OutcomeKind
from vergence.simulation import SimulatedDriver

FOLDER = Path(__file__).parents[1] / "examples" / "hardware"
TIMEOUT_S = 2.0  # of a machine that has other things to do
SLOW = {"inner_rate_hz": "125", "outputs": '{grip = {arm = "puma"}}'}
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

    def set_output(self, name, value) -> None:
        vars(self).setdefault("outputs_set", []).append((name, value))
        super().set_output(name, value)


class Robot(Thread):
    """The robot of the example, in a thread, so that its arm can be looked at."""

    def __init__(self, example: Callable[[str], object], images: bool, timeout_s: float) -> None:
        super().__init__(daemon=True)
        self._serve, self._images, self._timeout_s = example("robot").serve, images, timeout_s
        self._clients = example("clients").Clients
        self.listener, self.ready = socket.create_server(("localhost", 0)), Event()
        self.address = self.listener.getsockname()
        self.end = ""
        self.start()
        assert self.ready.wait(60)

    def run(self) -> None:
        self.driver = Noted(load_cell("puma560", SLOW), self._images)
        clients = self._clients(self.listener)
        self.ready.set()
        self.end = self._serve(self.driver, clients, self._timeout_s)
        self.driver.close()
        self.listener.close()


def test_over_the_socket_the_arm_moves_as_it_does_directly(
    example: Callable[[str], object], model: SimulatedDriver, tmp_path: Path
) -> None:
    servo = example("servo").servo
    direct = SimulatedDriver(load_cell("puma560", SLOW))
    assert servo(direct, model, 1.5, tmp_path / "direct").succeeded
    direct.close()
    robot = Robot(example, True, TIMEOUT_S)
    driver = connected(robot.address, model)
    assert servo(driver, model, 1.5, tmp_path / "socket").succeeded
    driver.close()
    robot.join(60)
    assert robot.end.endswith("closed the connection; the arm is at rest")
    here, there = (Recording.open(tmp_path / way) for way in ("direct", "socket"))
    expected, actual = here.arms["puma"], there.arms["puma"]
    moved = np.ptp(expected.position, axis=0).max()
    for joint in range(6):
        place = np.interp(expected.time, actual.time, actual.position[:, joint])
        np.testing.assert_allclose(place, expected.position[:, joint], atol=0.05 * moved)


def connected(
    address: tuple[str, int], model: SimulatedDriver, timeout_s: float = TIMEOUT_S
) -> Driver:
    """The client's side, for the cameras of the robot."""
    equipment = Equipment("", model.arms, model.cameras, model.inner_rate_hz)
    host, port = address[:2]
    return SocketRobot(f"{host}:{port}", timeout_s=timeout_s).open(equipment)


def test_outputs_of_the_robot_are_known_and_set_over_the_socket(
    example: Callable[[str], object], model: SimulatedDriver
) -> None:
    robot = Robot(example, False, TIMEOUT_S)
    driver = connected(robot.address, model)
    assert outputs_of(driver) == ("grip",)
    driver.set_output("grip", 1.0)
    for _ in range(5):
        driver.step({})
    driver.close()
    robot.join(60)
    assert robot.driver.outputs_set == [("grip", 1.0)]


@contextmanager
def moving_client(robot: Robot, then: str = "") -> Iterator[subprocess.Popen[bytes]]:
    """A process that moves the arm, up to speed."""
    command = [sys.executable, "-c", DRIVE, str(robot.address[1]), *filter(None, [then])]
    with subprocess.Popen(command, stdout=subprocess.PIPE) as client:
        assert client.stdout is not None
        assert client.stdout.readline() == b"moving\n"
        try:
            yield client
        finally:
            client.kill()


def test_an_arm_whose_client_is_killed_brakes_to_rest_within_its_limits(
    example: Callable[[str], object], model: SimulatedDriver
) -> None:
    robot = Robot(example, False, TIMEOUT_S)
    with moving_client(robot) as client:
        client.send_signal(signal.SIGKILL)
        robot.join(60)
    assert robot.end.startswith("test closed the connection")
    assert_braked(robot.driver, model)


def test_an_arm_whose_client_hangs_brakes_to_rest_within_its_limits(
    example: Callable[[str], object], model: SimulatedDriver
) -> None:
    robot = Robot(example, False, 0.3)
    with moving_client(robot) as client:
        client.send_signal(signal.SIGSTOP)
        robot.join(60)
    assert robot.end == "test was silent for 0.3 s; the arm is at rest"
    assert_braked(robot.driver, model)


def assert_braked(driver: SimulatedDriver, model: SimulatedDriver) -> FloatArray:
    velocity = np.array([setpoint.velocity for setpoint in driver.steps])
    assert np.abs(velocity[:, 0]).max() > 0.2  # it did move
    np.testing.assert_array_equal(velocity[-1], 0.0)
    arm = model.arms["puma"]
    assert (np.abs(np.diff(velocity, axis=0)) <= arm.acceleration_max / 125 + 1e-9).all()
    assert (np.abs(velocity) <= arm.rate_max).all()
    return velocity


# A client that turns the first joint at 0.3 rad/s, with nothing but the messages. What it does once
# the arm is up to speed is put in behind.
DRIVE = """
import json, socket, struct, sys, time
link = socket.create_connection(("localhost", int(sys.argv[1])))
def send(message):
    link.sendall(struct.pack("!I", len(message)) + message)
def receive():
    length, = struct.unpack("!I", link.recv(4, socket.MSG_WAITALL))
    return link.recv(length, socket.MSG_WAITALL)
send(b'{"client": "test"}')
first = None
while True:
    words = json.loads(receive())
    q, _ = words["joints"]["puma"]
    first = first or (words["time"], q)
    since = words["time"] - first[0]
    q = [first[1][0] + 0.3 * since, *first[1][1:]]
    answer = {"period": words["period"], "setpoints": {"puma": [q, [0.3, 0, 0, 0, 0, 0]]}}
    if 0.5 < since < 0.51:
        print("moving", flush=True)
    if since > 0.5 and len(sys.argv) > 2:
        exec(sys.argv[2])
        time.sleep(60)
    send(json.dumps(answer).encode())
"""

WRONG = {
    "half a message": 'link.sendall(struct.pack("!I", 500) + b\'{"per\')',
    "half a length": 'link.sendall(b"\\0")',
    "a length of gigabytes": 'link.sendall(b"\\xff" * 4)',
    "garbage": 'send(b"\\0garbage")',
    "deep nesting": 'send(b"[" * 60000)',
    "another shape": 'send(b\'{"period": 1, "setpoints": {"puma": [[0, 0], [0, 0]]}}\')',
    "no numbers": """send(b'{"period": 1, "setpoints": {"puma": [' + b",".join(
        [b"[" + b",".join([b"null"] * 6) + b"]"] * 2) + b"]}}")""",
    "not a number": """send(b'{"period": 1, "setpoints": {"puma": [' + b",".join(
        [b"[" + b",".join([b"NaN"] * 6) + b"]"] * 2) + b"]}}")""",
    "another arm": 'send(b\'{"period": 1, "setpoints": {"zzz": [[0], [0]]}}\')',
    "no period": 'send(b\'{"period": "x", "setpoints": {}}\')',
    "a period to come": 'send(b\'{"period": 999999, "setpoints": {}}\')',
    "a list": 'send(b"[1, 2]")',
    "a flood of old answers": """
link.setblocking(True)
while True:
    send(b'{"period": 1, "setpoints": {}}')""",
    "nothing read": "time.sleep(60)",
}


@pytest.mark.parametrize("wrong", WRONG)
def test_whatever_a_client_sends_the_servo_goes_on_and_the_arm_brakes_to_rest_in_time(
    example: Callable[[str], object], model: SimulatedDriver, wrong: str
) -> None:
    robot = Robot(example, False, 0.4)
    with moving_client(robot, WRONG[wrong]):
        robot.join(60)
        assert not robot.is_alive()
    assert robot.end.startswith("test ")
    assert robot.end.endswith("; the arm is at rest")
    velocity = assert_braked(robot.driver, model)
    moving = np.flatnonzero(velocity[:, 0] > 0.29)
    stop = len(velocity) - moving[-1]  # ticks of the servo's clock
    arm = model.arms["puma"]
    assert stop <= 0.3 / arm.acceleration_max[0] * 125 + 5
    assert (
        len(moving) <= (0.6 + 0.4) * 125 + 60
    )  # up to speed, the timeout, and what a busy CPU adds


def test_a_second_client_is_refused_and_told_who_is_served(
    example: Callable[[str], object], model: SimulatedDriver
) -> None:
    robot = Robot(example, False, TIMEOUT_S)
    with moving_client(robot):
        with pytest.raises(DriverSilent, match="refuses: it serves test; one client at a time"):
            connected(robot.address, model)
        before = len(robot.driver.steps)
        time.sleep(0.3)
        assert len(robot.driver.steps) > before
        assert robot.is_alive()
    robot.join(60)
    assert_braked(robot.driver, model)


@pytest.mark.parametrize(
    "hello", [b"", b"\0\0", b"\xff\xff\xff\xff", b"\0\0\0\2[]", b"GET / HTTP/1.1\r\n\r\n"]
)
def test_whoever_does_not_say_who_it_is_keeps_no_client_out(
    example: Callable[[str], object], model: SimulatedDriver, hello: bytes
) -> None:
    robot = Robot(example, False, TIMEOUT_S)
    with socket.create_connection(robot.address) as stranger:
        stranger.sendall(hello)
        driver = connected(robot.address, model, 10.0)
        driver.step({})
        driver.close()
    robot.join(60)
    assert robot.end.endswith("closed the connection; the arm is at rest")


def framed(text: str) -> bytes:
    return len(text).to_bytes(4, "big") + text.encode()


def state(
    joints: str = '{"puma": [[0,0,0,0,0,0],[0,0,0,0,0,0]]}', images: str = "[]", time: str = "0"
) -> bytes:
    return framed(f'{{"period": 0, "time": {time}, "images": {images}, "joints": {joints}}}')


ROBOT_SAYS = {
    b"": "said nothing for 0.5 s",
    b"\0\0\0\x50{": "said nothing for 0.5 s",
    b"\xff\xff\xff\xff": "sends a message of 4294967295 bytes",
    framed("abc"): "sends what is no message",
    framed("[]"): "sends what is no message",
    framed("[" * 60_000): "sends what is no message",
    framed("{}"): "sends something other than joints and images",
    framed('{"refused": "busy"}'): "refuses: busy",
    state(joints="{}"): "something other than joints",
    state(joints='{"puma": [[0], [0]]}'): "something other than 6 numbers",
    state(joints='{"puma": 1}'): "something other than positions and rates",
    state(time="1e400"): "other than 1 numbers",
    state(images='[["zzz", 0]]') + framed("x"): "image of another camera",
    state(images='[["wrist", 0]]') + framed("x"): "of another size",
    state(images='[["wrist", 0]]'): "said nothing for 0.5 s",
}


@pytest.mark.parametrize("said", ROBOT_SAYS)
def test_whatever_the_robot_sends_the_driver_is_silent_by_name_within_its_timeout(
    example: Callable[[str], object], model: SimulatedDriver, said: bytes
) -> None:
    with socket.create_server(("localhost", 0)) as listener:

        def speak() -> None:
            link, _ = listener.accept()
            with link:
                link.sendall(said)
                done.wait(60)

        done = Event()
        robot = Thread(target=speak)
        robot.start()
        try:
            with pytest.raises(DriverSilent, match=ROBOT_SAYS[said]):
                connected(listener.getsockname(), model, 0.5)
        finally:
            done.set()
            robot.join()


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
        try:
            yield robot, port
        finally:
            robot.kill()  # a stopped process would be waited for forever


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
    said, error = servo.communicate(timeout=120)
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
    with socket.create_server(("localhost", 0)) as listener:
        address = listener.getsockname()
        with pytest.raises(DriverSilent, match="said nothing"):
            connected(address, model, 0.1)
