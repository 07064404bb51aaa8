"""The driver `so101`: Feetech's own package against servos on a pty in another process.

`make test-drivers` runs it, in an environment that has ftservo-python-sdk.
"""

import json
from collections.abc import Iterator

import numpy as np
import pytest
from other_side import OtherSide
from rendered import Rendered

from vergence.assembly import open_driver, run_cell, run_driver
from vergence.assembly.open_driver import equipment
from vergence.cell import load_cell
from vergence.control import Guard
from vergence.drivers import Equipment
from vergence.drivers.so101 import So101
from vergence.errors import DriverSilent, InputError
from vergence.runtime import Driver
from vergence.runtime.driver import outputs_of
from vergence.signals import OutcomeKind, RobotMode, Sample

# As a first servoing: slowly. So a computer with other things to do keeps up, too.
SETTINGS = {
    "target.motion": "stationary",
    "task.desired": '"centred"',
    "duration_s": "8",
    "cameras.side.rate_hz": "10",
    "law.gain": "1.0",
    "arms.so100.rate_max_deg_s": "6",
    "arms.so100.acceleration_max_deg_s2": "72",
}
CELL = load_cell("so100", SETTINGS)
ARM = equipment(CELL).arms["so100"]
BLIND = Equipment("so100", {"so100": ARM}, {}, 100.0)
START = np.deg2rad(CELL.arms["so100"].start_deg)
SIGNS, ZEROS = (1, -1, 1, 1, -1), (2048, 2000, 2100, 2048, 2048)
TICK = 2 * np.pi / 4096
BUSY_S = 2.0  # by which a busy computer may be late


class Servos(OtherSide):
    """The servos in their process."""

    def __init__(self) -> None:
        gripper = 1000
        ticks = np.rint(np.array(ZEROS) + np.array(SIGNS) * START / TICK).astype(int)
        words = ",".join(map(str, (*ticks, gripper)))
        super().__init__("servo_chain.py", words, python=("-S",))
        self.port = self.line()

    def open(self, at: Equipment = BLIND, **settings: object) -> Driver:
        settings = {"timeout_s": BUSY_S, **settings}
        return So101(self.port, zero_ticks=ZEROS, signs=SIGNS, **settings).open(at)


@pytest.fixture
def servos() -> Iterator[Servos]:
    made = Servos()
    try:
        yield made
    finally:
        made.end()


def turn(driver: Driver, rate: float, seconds: float) -> Sample:
    """Turn the last joint."""
    sample = driver.read()
    guard = Guard(ARM, sample.joints["so100"].position, 1.0 / driver.inner_rate_hz)
    end = sample.time + seconds
    while sample.time < end:
        driver.step({"so100": guard.step(np.array([0, 0, 0, 0, rate]))})
        sample = driver.read()
    return sample


def test_the_arm_servoes_over_the_bus_as_it_does_in_simulation(servos: Servos) -> None:
    simulated = run_cell(CELL).summary["final_error_px"]
    at = equipment(CELL)
    camera = {"side": Rendered(CELL)}
    driver = servos.open(
        Equipment("", at.arms, at.cameras, 100.0, at.watched, camera), rate_hz=20.0
    )
    run = run_driver(CELL, driver, (), True)
    driver.close()
    assert run.outcome.kind in (OutcomeKind.REACHED, OutcomeKind.NOT_REACHED, OutcomeKind.COMPLETED)
    error = run.cameras["side"].error_px
    assert error is not None
    tick_px = 600 * TICK  # by which the image moves when a servo moves by its resolution
    assert float(np.nanmean(error[-10:])) <= 1.5 * simulated + 2 * tick_px


def test_joints_are_read_and_turned_as_in_the_model(servos: Servos) -> None:
    driver = servos.open()
    np.testing.assert_allclose(driver.read().joints["so100"].position, START, atol=TICK)
    moved = turn(driver, 0.1, 2.0).joints["so100"].position - START
    driver.close()
    assert moved[4] > 0.05
    assert np.abs(moved[:4]).max() <= 2 * TICK
    told = json.loads(servos.ask("tell"))
    assert told["torque"][:5] == [1] * 5  # it holds its place: without torque the arm would fall
    assert told["ticks"][4] < ZEROS[4] - 30  # that servo turns against the model


def test_the_gripper_is_a_servo_beside_the_arms_joints(servos: Servos) -> None:
    driver = servos.open(outputs={"gripper": (6, 1000, 2000)})
    assert outputs_of(driver) == ("gripper",)
    assert servos.tell()["torque"][5] == 0  # nothing moves before it is told to
    driver.set_output("gripper", 0.5)
    before = driver.read().joints["so100"].position
    after = turn(driver, 0.1, 1.0).joints["so100"].position
    driver.close()
    told = servos.tell()
    assert told["ticks"][5] == pytest.approx(1500, abs=2)
    assert told["torque"][5] == 1
    assert after[4] > before[4]  # the arm goes on meanwhile
    with pytest.raises(InputError, match=r"outputs.gripper: given 5; allowed: a servo that is no"):
        servos.open(outputs={"gripper": (5, 1000, 2000)})


@pytest.mark.parametrize("words", ["fault 3", "hot 2"])
def test_a_servo_in_trouble_holds_the_arm_until_it_is_well(servos: Servos, words: str) -> None:
    driver = servos.open()
    servos.ask(words)
    assert turn(driver, 0.0, 0.2).robots["so100"].mode is RobotMode.PROTECTIVE_STOP
    servos.ask("well 3")
    if words == "fault 3":
        assert turn(driver, 0.0, 0.2).robots["so100"].running
    driver.close()


@pytest.mark.parametrize(
    ("words", "said"),
    [("silent 4", "no answer from the servos for 2 s"), ("unplug", "has disappeared|no answer")],
)
def test_servos_that_are_gone_end_by_name(servos: Servos, words: str, said: str) -> None:
    driver = servos.open()
    servos.ask(words)
    with pytest.raises(DriverSilent, match=said):
        turn(driver, 0.1, 10.0)
    driver.close()


@pytest.mark.parametrize(
    ("words", "said"),
    [("silent 3", "servo 3 does not answer on"), ("other 2", "servo 2 is of model 1284")],
)
def test_a_bus_that_is_not_complete_is_refused(servos: Servos, words: str, said: str) -> None:
    servos.ask(words)
    with pytest.raises(DriverSilent, match=said):
        servos.open()


def test_wrong_settings_and_ports_are_refused() -> None:
    with pytest.raises(DriverSilent, match="port /dev/nowhere cannot be opened"):
        So101("/dev/nowhere").open(BLIND)
    with pytest.raises(
        InputError,
        match=r"driver.signs: given 2 values; allowed: 5, one "
        r"per joint",
    ):
        So101(signs=(1, 1)).open(BLIND)
    with pytest.raises(InputError, match=r"driver.cameras.side: missing"):
        open_driver(CELL, "so101")
