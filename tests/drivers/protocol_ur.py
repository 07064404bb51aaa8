"""The driver `ur`: ur_rtde's real client against a controller's interfaces in another process.

`make test-drivers` runs it, in an environment that has ur-rtde.
"""

import os
import signal
import time
from collections.abc import Iterator

import numpy as np
import pytest
from other_side import Motion, OtherSide, client_to_be_killed
from rendered import Rendered

from vergence.assembly import open_driver, run_cell, run_driver
from vergence.assembly.open_driver import equipment
from vergence.cell import load_cell
from vergence.drivers import Equipment
from vergence.drivers.bridge_driver import BridgeDriver
from vergence.drivers.ur import Ur
from vergence.errors import DriverSilent, InputError
from vergence.loading import Place, make_part
from vergence.runtime import Driver
from vergence.runtime.driver import outputs_of
from vergence.signals import RobotMode

STATIONARY = {"target.motion": '{ kind = "stationary" }', "task.desired": '"centred"'}
CELL = load_cell("ur5", STATIONARY)
BUSY = {"watchdog_hz": 2.0, "timeout_s": 3.0}  # what a busy computer does not trip
ARM = equipment(CELL).arms["ur5"]
BLIND = Equipment("ur5", {"ur5": ARM}, {}, 500.0)
START = np.deg2rad(CELL.arms["ur5"].start_deg)


class Robot(OtherSide):
    """The controller in its process."""

    count = 1

    def __init__(self) -> None:
        Robot.count += 1
        self.address = f"127.0.4.{Robot.count}"
        start = ",".join(map(str, START))
        super().__init__("ur_controller.py", self.address, start, python=("-S",))
        self.wait_until_ready()


@pytest.fixture
def robot() -> Iterator[Robot]:
    made = Robot()
    try:
        yield made
    finally:
        made.end()


@pytest.fixture
def driver(robot: Robot) -> Iterator[Driver]:
    opened = Ur(robot.address, **BUSY).open(BLIND)
    yield opened
    opened.close()


def test_the_arm_servoes_over_the_protocol_as_it_does_in_simulation(robot: Robot) -> None:
    cell = load_cell("ur5", STATIONARY | {"duration_s": "6"})
    simulated = run_cell(cell).summary["final_error_px"]
    at = equipment(cell)
    with_camera = Equipment(
        at.source, at.arms, at.cameras, at.inner_rate_hz, at.watched, {"wrist": Rendered(cell)}
    )
    driver = Ur(robot.address, **BUSY).open(with_camera)
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
    driver = Ur(robot.address, command=command, **BUSY).open(BLIND)
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
        ("version 5.9", "runs PolyScope 5.9, and ur_rtde needs 5.10 or newer: update it"),
        ("version 3.14", "runs PolyScope 3.14, and ur_rtde needs 3.15 or newer"),
    ],
)
def test_a_robot_that_would_not_move_is_refused_with_what_to_do(
    robot: Robot, words: str, said: str
) -> None:
    robot.set(words)
    with pytest.raises(DriverSilent, match=said):
        Ur(robot.address, **BUSY).open(BLIND)


def test_an_address_without_a_robot_is_refused() -> None:
    with pytest.raises(DriverSilent, match=r"no UR controller answers at 127.0.4.1, port 29999"):
        Ur("127.0.4.1").open(BLIND)


def test_a_cell_without_that_arm_or_camera_is_refused() -> None:
    with pytest.raises(InputError, match="7 joints; allowed: 6"):
        open_driver(load_cell("panda"), "ur:127.0.4.1")
    with pytest.raises(InputError, match=r"driver.cameras.wrist: missing"):
        open_driver(CELL, "ur:127.0.4.1")
    with pytest.raises(InputError, match="given ur; allowed: ur:ADDRESS"):
        open_driver(CELL, "ur")


def test_a_second_client_is_refused_and_the_first_continues(robot: Robot, driver: Driver) -> None:
    with pytest.raises(DriverSilent, match="another client controls the robot"):
        Ur(robot.address, **BUSY).open(BLIND)
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
    [("cable", "connection to the robot"), ("freeze", "clock has not advanced for 3 s")],
)
def test_a_robot_that_is_gone_is_told_by_name(robot: Robot, words: str, said: str) -> None:
    driver = Ur(robot.address, **BUSY).open(BLIND)
    motion = Motion(driver)
    motion.go(0.2, 0.3)
    robot.set(words)
    with pytest.raises(DriverSilent, match=said):
        motion.go(0.2, 30.0)
    driver.close()


def test_outputs_are_digital_outputs_of_the_robot(robot: Robot) -> None:
    outputs = {"gripper": "tool 1", "lamp": "standard 3", "valve": "configurable 2"}
    driver = Ur(robot.address, outputs=outputs, **BUSY).open(BLIND)
    assert outputs_of(driver) == ("gripper", "lamp", "valve")
    motion = Motion(driver)
    for name, value in (("gripper", 1.0), ("lamp", 1.0), ("valve", 0.7)):
        driver.set_output(name, value)
    motion.go(0.2, 0.3)
    assert robot.tell()["outputs"] == {"standard": 8, "configurable": 4, "tool": 2}
    driver.set_output("lamp", 0.0)
    before = motion.sample.joints["ur5"].position
    after = motion.go(0.2, 0.5).joints["ur5"].position
    driver.close()
    assert robot.tell()["outputs"] == {"standard": 0, "configurable": 4, "tool": 2}
    assert after[5] > before[5]  # the arm goes on meanwhile


def test_an_output_that_no_controller_has_is_refused() -> None:
    given = {"address": "x", "outputs": {"lamp": "standard 8"}}
    with pytest.raises(InputError, match=r"driver.outputs.lamp: given standard 8; allowed: "):
        make_part(Ur, given, Place("cell", "driver", None))


def test_a_crash_of_ur_rtde_is_told_by_name_and_the_arm_stops(robot: Robot, driver: Driver) -> None:
    motion = Motion(driver)
    motion.go(0.2, 0.5)
    assert isinstance(driver, BridgeDriver)
    os.kill(driver._bridge._process.pid, signal.SIGSEGV)
    with pytest.raises(
        DriverSilent, match="ur_rtde, which holds the connection to the robot, was ended by SIGSEGV"
    ):
        motion.go(0.2, 30.0)
    time.sleep(1.5)  # the watchdog's half second, and the braking
    assert robot.tell()["qd"] == [0.0] * 6


CLIENT = """
from protocol_ur import BLIND, BUSY
from vergence.drivers.ur import Ur
driver = Ur(sys.argv[2], **BUSY).open(BLIND)
"""


def test_an_arm_whose_client_is_killed_brakes(robot: Robot) -> None:
    with client_to_be_killed(CLIENT, robot.address):
        for _ in range(100):  # a busy computer accelerates late
            if (speed := robot.tell()["qd"][5]) > 0.2:
                break
            time.sleep(0.05)
        assert speed > 0.2
    time.sleep(1.5)  # the watchdog's half second, and the braking
    told = robot.tell()
    assert told["qd"] == [0.0] * 6
    assert not told["running"]
    assert told["hardest"] <= ARM.acceleration_max.max() + 1e-6
