"""The stop test of `vergence check`: a program that moves the arm is killed."""

import json
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from time import monotonic, sleep

import numpy as np
import pytest

from vergence.camera import Camera
from vergence.drivers.bring_up import killed_client_finding
from vergence.errors import DriverSilent
from vergence.robot import Arm
from vergence.signals import JointState, Sample, Setpoint


class Robot:
    """Goes on at the speed of its last set-point, whoever sent it, for some time."""

    inner_rate_hz = 50.0
    cameras: Mapping[str, Camera] = {}

    def __init__(self, file: Path, goes_on_s: float, clients: int) -> None:
        self._file, self._goes_on_s = file, goes_on_s
        with file.with_suffix(".clients").open("a+") as log:
            print("client", file=log)
            log.seek(0)
            if len(log.readlines()) > clients:
                raise DriverSilent("the robot takes no other client")
        self.arms = {"arm": _arm()}

    def read(self) -> Sample:
        time, q, rate = json.loads(self._file.read_text())
        now = monotonic()
        gone = min(now - time, self._goes_on_s)
        position = np.array(q) + gone * np.array(rate)
        return Sample(now, {"arm": JointState(now, position, np.array(rate))}, ())

    def step(self, setpoints: Mapping[str, Setpoint]) -> None:
        if "arm" in setpoints:
            to = setpoints["arm"]
            whole = self._file.with_suffix(".new")
            whole.write_text(json.dumps([monotonic(), to.position.tolist(), to.velocity.tolist()]))
            whole.replace(self._file)
        sleep(1.0 / self.inner_rate_hz)

    def close(self) -> None: ...


def _arm() -> Arm:
    from vergence.cell import load_cell
    from vergence.simulation import SimulatedDriver

    driver = SimulatedDriver(load_cell("ur5"), images=False)
    arm = driver.arms["ur5"]
    driver.close()
    return arm


@pytest.mark.parametrize(
    ("goes_on_s", "clients", "note"),
    [
        (0.2, 9, ""),
        (1e9, 9, "it still moves: give the robot a watchdog of its own"),
        (0.2, 1, "no connection afterwards: the robot takes no other client"),
    ],
)
def test_an_arm_that_does_not_stop_by_itself_is_found(
    tmp_path: Path, goes_on_s: float, clients: int, note: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("vergence.drivers.bring_up.killed_client._RECONNECTS_S", 0.1)
    file = tmp_path / "robot.json"
    arm = _arm()
    file.write_text(json.dumps([0.0, (0.1 * arm.q_max).tolist(), [0.0] * arm.joint_count]))
    found = killed_client_finding(
        partial(Robot, file, goes_on_s, clients), "arm", np.full(arm.joint_count, 0.02)
    )
    assert found.note == note
    assert found.holds is (not note)
    if not note:
        assert found.measured < 0.5
