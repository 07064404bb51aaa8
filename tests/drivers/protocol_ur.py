"""The driver `ur`: ur_rtde's real client against a controller's interfaces in another process.

`make test-drivers` runs it, in an environment that has ur-rtde.
"""

import json
import os
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from rendered import Rendered

from vergence.assembly import open_driver, run_cell, run_driver
from vergence.assembly.open_driver import equipment
from vergence.cell import load_cell
from vergence.control import Guard
from vergence.drivers import Equipment
from vergence.drivers.ur import Ur
from vergence.errors import DriverSilent, InputError
from vergence.runtime import Driver
from vergence.signals import RobotMode, Sample

STATIONARY = {"target.motion": '{ kind = "stationary" }', "task.desired": '"centred"'}
CELL = load_cell("ur5", STATIONARY)
BUSY = 2.0  # Hz, of the watchdog: a busy computer must not trip it
ARM = equipment(CELL).arms["ur5"]
BLIND = Equipment("ur5", {"ur5": ARM}, {}, 500.0)
START = np.deg2rad(CELL.arms["ur5"].start_deg)


class Robot:
    """The controller in its process."""

    count = 1

    def __init__(self) -> None:
        Robot.count += 1
        self.address = f"127.0.4.{Robot.count}"
        start = ",".join(map(str, START))
        program = Path(__file__).with_name("ur_controller.py")
        self.process = subprocess.Popen(
            [sys.executable, "-S", str(program), self.address, start],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        assert self._line() == "ready"

    def set(self, words: str) -> None:
        assert self._ask(words) == "ok"

    def tell(self) -> dict[str, object]:
        return json.loads(self._ask("tell"))

    def _ask(self, words: str) -> str:
        assert self.process.stdin is not None
        self.process.stdin.write(f"{words}\n")
        self.process.stdin.flush()
        return self._line()

    def _line(self) -> str:
        assert self.process.stdout is not None
        return self.process.stdout.readline().strip()


@pytest.fixture
def robot() -> Iterator[Robot]:
    made = Robot()
    try:
        yield made
    finally:
        made.process.kill()
        made.process.communicate()


@pytest.fixture
def driver(robot: Robot) -> Iterator[Driver]:
    opened = Ur(robot.address, watchdog_hz=BUSY).open(BLIND)
    yield opened
    opened.close()


class Motion:
    """Turns the last joint, within the limits, as the loop would."""

    def __init__(self, driver: Driver) -> None:
        self.driver, self.sample = driver, driver.read()
        self.guard = Guard(ARM, self.sample.joints["ur5"].position, 1.0 / driver.inner_rate_hz)

    def go(self, rate: float, seconds: float) -> Sample:
        """Make as many ticks as there are in so many seconds, however late each is."""
        for _ in range(round(seconds * self.driver.inner_rate_hz)):
            self.driver.step({"ur5": self.guard.step(np.array([0, 0, 0, 0, 0, rate]))})
            self.sample = self.driver.read()
        return self.sample


def test_the_arm_servoes_over_the_protocol_as_it_does_in_simulation(robot: Robot) -> None:
    cell = load_cell("ur5", STATIONARY | {"duration_s": "6"})
    simulated = run_cell(cell).summary["final_error_px"]
    at = equipment(cell)
    with_camera = Equipment(
        at.source, at.arms, at.cameras, at.inner_rate_hz, at.watched, {"wrist": Rendered(cell)}
    )
    driver = Ur(robot.address, watchdog_hz=BUSY).open(with_camera)
    run = run_driver(cell, driver, (), True)
    driver.close()
    assert run.outcome.succeeded
    error = run.cameras["wrist"].error_px
    final = float(np.nanmean(error[-10:])) if error is not None else np.nan
    assert final <= 1.5 * simulated + 0.5
    told = robot.tell()
    assert np.abs(np.array(told["q"]) - START).max() > 0.01  # it did move
    assert np.abs(told["qd"]).max() < 1e-3
    assert told["fastest"] <= ARM.rate_max.max() + 1e-6
    assert told["hardest"] <= ARM.acceleration_max.max() + 1e-6


@pytest.mark.parametrize("command", ["speedj", "servoj"])
def test_joints_follow_their_set_points(robot: Robot, command: str) -> None:
    driver = Ur(robot.address, command=command, watchdog_hz=BUSY).open(BLIND)
    motion = Motion(driver)
    motion.go(0.3, 1.0)
    moved = motion.go(0.0, 0.6).joints["ur5"].position - START
    asked = motion.guard.position - START
    driver.close()
    assert asked[5] > 0.2
    np.testing.assert_allclose(moved, asked, atol=0.01)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("remote off", "not in remote control: choose Remote Control"),
        ("mode 5", "mode idle, not running: switch it on and release its brakes"),
        ("protective", "reports protective stop: clear it on the teach pendant"),
        ("emergency", "reports robot emergency stop"),
    ],
)
def test_a_robot_that_would_not_move_is_refused_with_what_to_do(
    robot: Robot, words: str, said: str
) -> None:
    robot.set(words)
    with pytest.raises(DriverSilent, match=said):
        Ur(robot.address, watchdog_hz=BUSY).open(BLIND)


def test_an_address_without_a_robot_is_refused() -> None:
    with pytest.raises(DriverSilent, match=r"no UR controller answers at 127.0.4.1, port 29999"):
        Ur("127.0.4.1").open(BLIND)


def test_a_cell_without_that_arm_or_camera_is_refused() -> None:
    with pytest.raises(InputError, match="7 joints; allowed: 6"):
        open_driver(load_cell("panda"), "ur:127.0.4.1")
    with pytest.raises(InputError, match=r"driver.cameras.wrist: given nothing"):
        open_driver(CELL, "ur:127.0.4.1")
    with pytest.raises(InputError, match="address: given nothing"):
        open_driver(CELL, "ur")


def test_a_second_client_is_refused_and_the_first_goes_on(robot: Robot, driver: Driver) -> None:
    with pytest.raises(DriverSilent, match="another client controls the robot"):
        Ur(robot.address, watchdog_hz=BUSY).open(BLIND)
    Motion(driver).go(0.1, 0.2)


def test_states_of_the_robot_are_those_that_the_loop_knows(robot: Robot, driver: Driver) -> None:
    motion = Motion(driver)
    robot.set("slider 0.5")
    assert motion.go(0.0, 0.2).robots["ur5"].speed_scale == 0.5
    robot.set("slider 1")
    for words, mode in (
        ("teach on", RobotMode.HAND_GUIDED),
        ("teach off", RobotMode.RUNNING),
        ("emergency", RobotMode.EMERGENCY_STOP),
    ):
        robot.set(words)
        assert motion.go(0.0, 0.2).robots["ur5"].mode is mode


def test_the_speed_slider_slows_set_points_once(robot: Robot, driver: Driver) -> None:
    robot.set("slider 0.5")
    motion = Motion(driver)
    motion.go(0.2, 1.0)  # what the loop makes of 0.4 rad/s
    np.testing.assert_allclose(motion.sample.joints["ur5"].velocity[5], 0.2, atol=0.02)


def test_after_a_protective_stop_is_cleared_the_arm_moves_again(
    robot: Robot, driver: Driver
) -> None:
    motion = Motion(driver)
    motion.go(0.2, 0.3)
    robot.set("protective")
    assert motion.go(0.0, 0.3).robots["ur5"].mode is RobotMode.PROTECTIVE_STOP
    robot.set("clear")
    for _ in range(50):
        if motion.go(0.0, 0.1).robots["ur5"].running and robot.tell()["running"]:
            break
    before = motion.sample.joints["ur5"].position
    after = motion.go(0.2, 0.5).joints["ur5"].position
    assert after[5] - before[5] > 0.05


@pytest.mark.parametrize(
    ("words", "said"),
    [("cable", "connection to the robot is broken"), ("freeze", "clock has stood for 0.5 s")],
)
def test_a_robot_that_is_gone_is_told_by_name(robot: Robot, words: str, said: str) -> None:
    driver = Ur(robot.address, watchdog_hz=BUSY).open(BLIND)
    motion = Motion(driver)
    motion.go(0.2, 0.3)
    robot.set(words)
    with pytest.raises(DriverSilent, match=said):
        motion.go(0.2, 3.0)
    driver.close()


CLIENT = """
import sys
sys.path[:0] = sys.argv[2:]
from protocol_ur import BLIND, BUSY, Motion
from vergence.drivers.ur import Ur
motion = Motion(Ur(sys.argv[1], watchdog_hz=BUSY).open(BLIND))
motion.go(0.3, 0.5)
print("moving", flush=True)
motion.go(0.3, 60)
"""


def test_an_arm_whose_client_is_killed_brakes(robot: Robot) -> None:
    folder = str(Path(__file__).parent)
    with subprocess.Popen(
        [sys.executable, "-c", CLIENT, robot.address, folder],
        stdout=subprocess.PIPE,
        text=True,
        env=dict(os.environ),
    ) as client:
        assert client.stdout is not None
        assert client.stdout.readline() == "moving\n"
        assert robot.tell()["qd"][5] > 0.2
        client.kill()
    time.sleep(1.5)  # the watchdog's half second, and the braking
    told = robot.tell()
    assert told["qd"] == [0.0] * 6
    assert not told["running"]
    assert told["hardest"] <= ARM.acceleration_max.max() + 1e-6
