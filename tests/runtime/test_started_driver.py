"""A robot's run begins with the joints of now, however long it took to prepare it."""

from collections.abc import Mapping
from time import monotonic, sleep

import pytest

from vergence.assembly.started_driver import StartedDriver
from vergence.cell import load_cell
from vergence.runtime import DriverWrapper
from vergence.signals import Frame, Sample, Setpoint
from vergence.simulation import SimulatedDriver

PREPARING_S = 0.15


class Robot:
    """A robot whose clock runs on; its driver learns the time, as others do, in `step`."""

    def __init__(self, simulated: SimulatedDriver) -> None:
        first = simulated.read()
        self.arms, self.cameras = simulated.arms, simulated.cameras
        self.inner_rate_hz, self._joints = 50.0, first.joints
        self._image = next(f.image for f in first.frames if f.image is not None)
        self._begun, self._time, self._exposed = monotonic(), 0.0, -1.0

    def read(self) -> Sample:
        exposed = 0.1 * (self._time // 0.1)
        new, self._exposed = exposed > self._exposed, exposed
        frames = (Frame("wrist", exposed, self._image, {}),) if new else ()
        return Sample(self._time, self._joints, frames, {})

    def step(self, setpoints: Mapping[str, Setpoint]) -> None:
        sleep(1.0 / self.inner_rate_hz)
        self._time = monotonic() - self._begun

    def close(self) -> None:
        pass


@pytest.fixture
def simulated() -> SimulatedDriver:
    return SimulatedDriver(load_cell("puma560"))


def test_a_robots_run_does_not_begin_with_joints_from_before_its_preparation(
    simulated: SimulatedDriver,
) -> None:
    started = StartedDriver(Robot(simulated), ("wrist",))
    simulated.close()
    sleep(PREPARING_S)
    first = started.read()
    assert first.time > PREPARING_S
    assert all(frame.time >= first.time for frame in first.frames)


class SlowlyOpened(Robot):
    """A robot whose cameras took long to open: its first joints are from before that."""

    def read(self) -> Sample:
        if self._time == 0.0 and self._exposed < 0.0:
            self._begun -= 0.8
            self._exposed = 0.8
            return Sample(0.0, self._joints, (Frame("wrist", 0.8, self._image, {}),), {})
        return super().read()


def test_what_a_run_begins_with_is_not_newer_than_its_joints(simulated: SimulatedDriver) -> None:
    started = StartedDriver(SlowlyOpened(simulated), ("wrist",))
    simulated.close()
    assert started.frames["wrist"].time <= 0.0
    first = started.read()
    assert first.time >= 0.8
    assert all(frame.time <= first.time for frame in first.frames)


class Simulator(Robot):
    """A user's own simulator, whose time passes in `step` only."""

    sim_time = True


def test_the_time_of_a_simulator_of_ones_own_stands_meanwhile(simulated: SimulatedDriver) -> None:
    robot = Simulator(simulated)
    started = StartedDriver(robot, ("wrist",))
    simulated.close()
    waited_until = robot.read().time
    sleep(PREPARING_S)
    assert started.read().time == waited_until


@pytest.mark.parametrize("wrapped", [False, True])
def test_a_simulations_time_stands_meanwhile(simulated: SimulatedDriver, wrapped: bool) -> None:
    started = StartedDriver(DriverWrapper(simulated) if wrapped else simulated, ("wrist",))
    waited_until = simulated.time
    sleep(PREPARING_S)
    first = started.read()
    simulated.close()
    assert first.time == waited_until
