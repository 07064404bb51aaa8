"""`ArmDriver`: an arm's set-points keep the time of its controller's clock."""

import numpy as np
import pytest

from vergence.assembly.open_driver import equipment
from vergence.cell import load_cell
from vergence.drivers import ArmDriver, ArmReading, Equipment
from vergence.errors import DriverSilent
from vergence.signals import Setpoint

ARMS = equipment(load_cell("puma560")).arms
REST = Setpoint(np.zeros(6), np.zeros(6))


class Scripted:
    """A controller whose clock shows what a test says, at one reading after another."""

    rate_hz = 100.0

    def __init__(self, times: list[float], catch_up_s: float) -> None:
        self.times, self.catch_up_s, self.sent = iter(times), catch_up_s, []
        self.time = 0.0

    def read(self) -> ArmReading:
        self.time = next(self.times, self.time)
        return ArmReading(self.time, np.full(6, self.time), np.zeros(6))

    def send(self, setpoint: Setpoint) -> None:
        self.sent.append(self.time)

    def close(self) -> None: ...


def ticks(times: list[float], catch_up_s: float, count: int) -> list[float]:
    """The controller's time after each of so many ticks."""
    link = Scripted([0.0, *times], catch_up_s)
    driver = ArmDriver(Equipment("", ARMS, {}, 100.0), "puma", link, timeout_s=0.2)
    seen = []
    for _ in range(count):
        driver.step({"puma": REST})
        seen.append(driver.read().time)
    driver.close()
    return seen


def test_a_tick_comes_when_the_controllers_clock_reaches_it() -> None:
    assert ticks([0.004, 0.01, 0.011, 0.02], 0.0, 2) == [0.01, 0.02]


def test_positions_are_never_sent_in_a_rush_after_a_pause() -> None:
    after = [0.01, 0.2, 0.201, 0.205, 0.21, 0.215, 0.22]
    assert ticks(after, 0.0, 4) == [0.01, 0.2, 0.21, 0.22]


def test_speeds_make_up_for_a_short_pause_and_not_for_a_long_one() -> None:
    assert ticks([0.01, 0.05, 0.051, 0.052, 0.053], 0.05, 5) == [0.01, 0.05, 0.051, 0.052, 0.053]
    assert ticks([0.01, 0.9, 0.901, 0.91], 0.05, 3) == [0.01, 0.9, 0.91]


def test_a_clock_that_stands_is_a_silent_driver() -> None:
    with pytest.raises(DriverSilent, match=r"clock has not advanced for 0.2 s"):
        ticks([0.01], 0.0, 2)
