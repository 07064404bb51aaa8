"""A robot with late images and a slow servo: the loop makes up for what is known of both."""

from collections import deque
from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest

from vergence.assembly import run_driver
from vergence.cell import load_cell
from vergence.runtime import Run
from vergence.runtime.driver_wrapper import DriverWrapper
from vergence.runtime.hardware import LateStamps
from vergence.runtime.servo_lag import ServoLag
from vergence.signals import Frame, JointState, Sample, Setpoint
from vergence.simulation import SimulatedDriver


class Late(DriverWrapper):
    """Stamps images when they arrive, `image_s` after exposure; moves `servo_s` too late."""

    def __init__(self, driver: SimulatedDriver, image_s: float, servo_s: float) -> None:
        super().__init__(driver)
        self._image_s, self._ticks = image_s, round(servo_s * driver.inner_rate_hz)
        self._told: deque[Mapping[str, Setpoint]] = deque()
        self._waiting: list[Frame] = []

    def read(self) -> Sample:
        sample = self.driver.read()
        self._waiting += [replace(f, time=f.time + self._image_s) for f in sample.frames]
        there = [frame.time <= sample.time + 1e-9 for frame in self._waiting]
        arrived = tuple(f for f, ready in zip(self._waiting, there, strict=True) if ready)
        self._waiting = self._waiting[len(arrived) :]
        return replace(sample, frames=arrived)

    def step(self, setpoints: Mapping[str, Setpoint]) -> None:
        self._told.append(setpoints)
        late = len(self._told) > self._ticks
        self.driver.step(self._told.popleft() if late else {})


def run(image_s: float, servo_s: float, known: bool) -> Run:
    cell = load_cell("ur5", {"duration_s": "7", "cameras.wrist.latency_frames": "0"})
    driver = Late(SimulatedDriver(cell, images=False), image_s, servo_s)
    set_back = LateStamps(driver, {"wrist": image_s if known else 0.0})
    return run_driver(cell, set_back, (), False, servo_lag_s=servo_s if known else 0.0)


def error_px(made: Run) -> float:
    trace = made.cameras["wrist"]
    away = np.linalg.norm(trace.true_px - trace.desired_px, axis=2)[len(trace.time) // 3 :]
    return float(np.sqrt(np.mean(away**2)))


@pytest.mark.parametrize(
    ("image_s", "servo_s", "most_px"), [(0.15, 0.0, 14.0), (0.0, 0.15, 14.0), (0.1, 0.1, 18.0)]
)
def test_what_is_known_of_the_delays_is_made_up_for(
    image_s: float, servo_s: float, most_px: float
) -> None:
    made = run(image_s, servo_s, known=True)
    assert made.outcome.succeeded
    assert error_px(made) < most_px
    unknown = run(image_s, servo_s, known=False)
    assert not unknown.outcome.succeeded or error_px(unknown) > 1.2 * error_px(made)


def test_a_servo_with_an_offset_is_foreseen_without_it() -> None:
    lag, ticks, dt = ServoLag(5, 0.01), 40, 0.01
    told = [0.3 * np.sin(3.0 * k * dt) for k in range(ticks)]
    for k in range(ticks):
        if k > 5:
            measured = np.array([told[k - 6] + 0.02])  # by the set-point five ticks before the last
            ahead = lag.ahead(JointState(k * dt, measured, np.zeros(1)))
            assert ahead.time == pytest.approx((k + 5) * dt)
            np.testing.assert_allclose(ahead.position, told[k - 1] + 0.02, atol=1e-12)
        lag.add(Setpoint(np.array([told[k]]), np.zeros(1)))


def test_without_a_lag_joints_are_as_measured() -> None:
    lag, joints = ServoLag(0, 0.01), JointState(0.0, np.ones(2), np.zeros(2))
    lag.add(Setpoint(np.full(2, 3.0), np.ones(2)))
    assert lag.ahead(joints) is joints
