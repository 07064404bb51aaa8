"""The driver `franka`: franky's real client against a robot behind libfranka's protocol.

`make test-drivers` runs it, in an environment that has franky-control and franky-sim.
"""

import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from other_side import Motion, OtherSide, client_to_be_killed
from rendered import Rendered

from vergence.assembly import open_driver, run_cell, run_driver
from vergence.assembly.open_driver import equipment
from vergence.cell import load_cell
from vergence.drivers import Equipment
from vergence.drivers.franka import Franka
from vergence.errors import DriverSilent, InputError
from vergence.runtime import Driver
from vergence.runtime.driver import outputs_of
from vergence.signals import RobotMode

SETTINGS = {
    "duration_s": "6",
    "target.motion": "stationary",
    "task.desired": '"centred"',
    "target.position_m": "[0.5, 0.02, 0.12]",
    "law.gain": "1.5",
    "cameras.hand.rate_hz": "15",
}
CELL = load_cell("panda", SETTINGS)
ARM = equipment(CELL).arms["panda"]
BLIND = Equipment("panda", {"panda": ARM}, {}, 500.0)
START = np.deg2rad(CELL.arms["panda"].start_deg)
BUSY_S = 5.0  # by which a busy computer may be late
RATE_HZ = 100.0  # which a busy computer can keep
# Of the robot's data sheet: what its reflexes would stop at.
ACCELERATION = np.array([15.0, 7.5, 10.0, 12.5, 15.0, 20.0, 20.0])
JERK = np.array([7500.0, 3750.0, 5000.0, 6250.0, 7500.0, 10000.0, 10000.0])


class Robot(OtherSide):
    """The robot in its process."""

    count = 1

    def __init__(self) -> None:
        Robot.count += 1
        self.address = f"127.0.5.{Robot.count}"
        super().__init__("franka_robot.py", self.address, ",".join(map(str, START)))
        self.wait_until_ready()

    def open(self, at: Equipment = BLIND, **settings: object) -> Driver:
        usual = {"realtime": False, "timeout_s": BUSY_S, "rate_hz": RATE_HZ, "watchdog_s": 0.5}
        return Franka(self.address, **(usual | settings)).open(at)

    def wait(self, seconds: float) -> dict[str, object]:
        """Return what the robot tells so many seconds of its clock later."""
        begin = self.tell()["time"][0]
        while (told := self.tell())["time"][0] < begin + seconds:
            time.sleep(0.05)
        return told


@pytest.fixture
def robot() -> Iterator[Robot]:
    made = Robot()
    try:
        yield made
    finally:
        made.end()


def assert_without_reflex(told: dict[str, object]) -> None:
    """Hold what was commanded against the limits of cell and robot."""
    assert (np.array(told["fastest"]) <= ARM.rate_max + 1e-6).all()
    most = np.minimum(0.8 * ACCELERATION, ARM.acceleration_max)
    assert (np.array(told["hardest"]) <= 1.01 * most).all()
    assert (np.array(told["jerkiest"]) <= JERK).all()


def test_the_arm_servoes_over_the_protocol_as_it_does_in_simulation(robot: Robot) -> None:
    simulated = run_cell(CELL).summary["final_error_px"]
    at, camera = equipment(CELL), Rendered(CELL)
    seeing = Equipment("", at.arms, at.cameras, RATE_HZ, at.watched, {"hand": camera})
    driver = robot.open(seeing)
    camera.clocked_by(lambda: driver._reading.time)  # a busy computer simulates less than real time
    run = run_driver(CELL, driver, (), True)
    driver.close()
    told = robot.tell()
    error = run.cameras["hand"].error_px
    assert run.outcome.succeeded
    assert error is not None
    assert float(np.nanmean(error[-10:])) <= 1.5 * simulated + 0.5
    assert np.abs(np.array(told["q"]) - START).max() > 0.01  # it did move
    assert_without_reflex(told)


def test_joints_follow_their_set_points_without_a_jerk(robot: Robot) -> None:
    driver = robot.open()
    motion = Motion(driver)
    np.testing.assert_allclose(motion.sample.joints["panda"].position, START, atol=0.01)
    for rate in (0.5, -0.5, 2.0, 0.0):
        motion.go(rate, 0.5)
    motion.go(0.0, 1.5)
    moved = motion.sample.joints["panda"].position - START
    asked = motion.guard.position - START
    driver.close()
    assert abs(asked[6]) > 0.2
    np.testing.assert_allclose(moved, asked, atol=0.01)
    assert_without_reflex(robot.tell())


def test_states_of_the_robot_are_those_that_the_loop_knows(robot: Robot) -> None:
    driver = robot.open()
    motion = Motion(driver)
    motion.go(0.1, 0.2)
    for words, mode in (
        ("reflex", RobotMode.PROTECTIVE_STOP),
        ("user", RobotMode.EMERGENCY_STOP),
        ("guiding", RobotMode.HAND_GUIDED),
    ):
        robot.set(words)
        assert motion.go(0.0, 0.3).robots["panda"].mode is mode
    driver.close()


def test_after_a_stop_is_cleared_the_arm_moves_again(robot: Robot) -> None:
    driver = robot.open()
    motion = Motion(driver)
    motion.go(0.2, 0.3)
    robot.set("reflex")
    assert not motion.go(0.0, 0.3).robots["panda"].running
    robot.set("well")
    while not motion.go(0.0, 0.05).robots["panda"].running:
        pass
    motion.go(0.0, 1.0)
    before = motion.sample.joints["panda"].position[6]
    assert motion.go(0.2, 1.0).joints["panda"].position[6] - before > 0.05
    driver.close()


@pytest.mark.parametrize(
    ("words", "said"),
    [("user", "reports user stop: release"), ("locked", "joints are locked: unlock them in Desk")],
)
def test_a_robot_that_would_not_move_is_refused_with_what_to_do(
    robot: Robot, words: str, said: str
) -> None:
    robot.set(words)
    with pytest.raises(DriverSilent, match=said):
        robot.open()


def test_a_second_client_is_refused_and_the_first_continues(robot: Robot) -> None:
    driver = robot.open()
    with pytest.raises(DriverSilent, match=r"no Franka robot answers at .* no other client is"):
        robot.open(connect_s=1.0)
    Motion(driver).go(0.1, 0.2)
    driver.close()


def test_a_robot_that_is_gone_is_told_by_name(robot: Robot) -> None:
    driver = robot.open(timeout_s=1.0)
    motion = Motion(driver)
    motion.go(0.2, 0.3)
    robot.process.kill()
    with pytest.raises(
        DriverSilent, match=r"does not answer any more|clock has not advanced for 1 s"
    ):
        motion.go(0.2, 10.0)
    driver.close()


def test_a_client_that_says_nothing_leaves_an_arm_that_brakes(robot: Robot) -> None:
    driver = robot.open()
    motion = Motion(driver)
    motion.go(0.5, 0.5)
    told = robot.wait(1.5)
    driver.close()
    assert np.abs(told["qd_d"]).max() < 1e-3
    assert_without_reflex(told)


CLIENT = """
from protocol_franka import BLIND
from vergence.drivers.franka import Franka
driver = Franka(sys.argv[2], realtime=False, timeout_s=5, rate_hz=100).open(BLIND)
"""


def test_an_arm_whose_client_is_killed_stops(robot: Robot) -> None:
    with client_to_be_killed(CLIENT, robot.address):
        assert robot.tell()["fastest"][6] > 0.2
    first = robot.wait(1.5)["q"]
    np.testing.assert_allclose(robot.wait(0.5)["q"], first, atol=1e-3)


def test_wrong_cells_addresses_and_kernels_are_refused() -> None:
    with pytest.raises(InputError, match="6 joints; allowed: 7"):
        open_driver(load_cell("ur5"), "franka:127.0.5.1")
    with pytest.raises(InputError, match=r"driver.cameras.hand: missing"):
        open_driver(CELL, "franka:127.0.5.1")
    with pytest.raises(DriverSilent, match=r"no Franka robot with an active FCI answers at 127"):
        Franka("127.0.5.1", realtime=False).open(BLIND)
    if not Path("/sys/kernel/realtime").exists():
        with pytest.raises(DriverSilent, match=r"no real-time kernel, which libfranka needs"):
            Franka("127.0.5.1").open(BLIND)


def test_the_hand_closes_and_opens_while_the_arm_moves(robot: Robot) -> None:
    driver = robot.open(gripper="hand")
    assert outputs_of(driver) == ("hand",)
    wide = robot.tell()["fingers"][0]
    driver.set_output("hand", 1.0)
    motion = Motion(driver)
    before = motion.sample.joints["panda"].position
    after = motion.go(0.1, 1.0).joints["panda"].position
    closed = robot.wait(2.0)["fingers"][0]
    driver.set_output("hand", 0.0)
    opened = robot.wait(2.0)["fingers"][0]
    driver.close()
    assert after[6] > before[6] + 0.03
    assert closed < 0.01 < wide <= opened + 1e-3
    assert_without_reflex(robot.tell())
