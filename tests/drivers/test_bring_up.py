"""`vergence check`: each thing that may be wrong with a robot is found, and a good one passes."""

import json
from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest

from vergence.cell import load_cell
from vergence.drivers.bring_up import Finding, bring_up, watched
from vergence.signals import JointState, Sample, Setpoint
from vergence.simulation import SimulatedDriver

SETTINGS = {
    "target.motion": "stationary",
    "inner_rate_hz": "125",
    "cameras.wrist.rate_hz": "10",
}
CELL = load_cell("ur5", SETTINGS)
NUDGE = np.deg2rad(2.0)
BLACK = np.zeros((480, 640), np.uint8)


class Robot(SimulatedDriver):
    """A simulated robot that differs from its model in what a test says."""

    def __init__(
        self, monkeypatch: pytest.MonkeyPatch, images: bool = False, **faults: object
    ) -> None:
        super().__init__(CELL, images)
        self.order = faults.get("order", [0, 1, 2, 3, 4, 5])
        self.sign = np.array(faults.get("sign", [1.0] * 6))
        self.unit, self.pace = faults.get("unit", 1.0), faults.get("pace", 1.0)
        self.late_s, self.blind = faults.get("late_s", 0.0), faults.get("blind", False)
        self.rate_unit = faults.get("rate_unit", 1.0)
        self.start = self.world.joint_position("ur5")
        monkeypatch.setattr(watched, "monotonic", lambda: self.pace * self.time)

    def read(self) -> Sample:
        sample = super().read()
        state = sample.joints["ur5"]
        q = self.start + self.sign * (state.position - self.start)[self.order]
        rate = self.rate_unit * self.sign * state.velocity[self.order]
        joints = {"ur5": JointState(state.time, q, rate)}
        frames = tuple(
            replace(f, time=f.time - self.late_s, image=BLACK if f.image is None else f.image)
            for f in sample.frames
        )
        return Sample(sample.time, joints, () if self.blind else frames)

    def step(self, setpoints: Mapping[str, Setpoint]) -> None:
        moved = {
            name: Setpoint(self.start + self.unit * (s.position - self.start), s.velocity)
            for name, s in setpoints.items()
        }
        super().step(moved)


def findings(robot: Robot, camera: bool = False) -> list[Finding]:
    from vergence.app.bring_up import carried_camera

    rates = {"wrist": CELL.cameras["wrist"].rate_hz}
    carried = carried_camera(CELL) if camera else None
    found = list(bring_up(robot, "ur5", rates, carried, NUDGE, 0.005, 1.0))
    robot.close()
    return found


def wrong(found: list[Finding]) -> dict[str, str]:
    return {each.name: each.note for each in found if not each.holds}


def test_a_robot_that_is_as_its_model_passes_and_returns_to_its_start(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    robot = Robot(monkeypatch, images=True)
    found = findings(robot, camera=True)
    assert wrong(found) == {}
    assert sum("moves as commanded" in each.name for each in found) == 6
    assert sum("turns as in the model" in each.name for each in found) == 6
    assert np.abs(robot.world.joint_position("ur5") - robot.start).max() < 0.002


def test_a_joint_that_turns_the_other_way_than_its_model_is_seen_in_the_image(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    robot = Robot(monkeypatch, images=True)
    monkeypatch.setattr(SimulatedDriver, "step", _mirrored(SimulatedDriver.step, robot))
    robot.sign = np.array([1.0, 1, 1, 1, -1, 1])  # it reports what it was told, not what it did
    assert set(wrong(findings(robot, camera=True))) == {"wrist_2_joint turns as in the model"}


def _mirrored(step, robot: Robot):
    def mirrored(self, setpoints: Mapping[str, Setpoint]) -> None:
        sign = np.array([1.0, 1, 1, 1, -1, 1])
        turned = {
            name: Setpoint(robot.start + sign * (s.position - robot.start), sign * s.velocity)
            for name, s in setpoints.items()
        }
        step(self, turned)

    return mirrored


@pytest.mark.parametrize(
    ("faults", "name", "note"),
    [
        ({"sign": [1, 1, -1, 1, 1, 1]}, "elbow_joint moves as commanded", "the other way"),
        ({"order": [1, 0, 2, 3, 4, 5]}, "shoulder_pan_joint moves as commanded", "another order"),
        ({"unit": 57.3 / 180}, "elbow_joint moves as commanded", "another amount"),
        ({"rate_unit": 57.3}, "elbow_joint reports its rate", "another unit"),
        ({"pace": 1.2}, "drift of the robot's clock", "another clock"),
        ({"late_s": 0.5}, "age of the images of wrist by their stamps", "another clock"),
        ({"late_s": -0.5}, "age of the images of wrist by their stamps", "another clock"),
        ({"blind": True}, "images of wrist", "no image"),
    ],
)
def test_what_is_wrong_is_named_with_its_cause(
    monkeypatch: pytest.MonkeyPatch, faults: dict[str, object], name: str, note: str
) -> None:
    told = wrong(findings(Robot(monkeypatch, **faults)))
    assert note in told[name]


def test_no_joint_moves_before_everything_at_rest_holds(monkeypatch: pytest.MonkeyPatch) -> None:
    robot = Robot(monkeypatch, late_s=0.5)
    assert not any("moves as commanded" in each.name for each in findings(robot))


def test_the_command_prints_and_writes_what_it_found(
    tmp_path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    from vergence import assembly
    from vergence.app.bring_up import check
    from vergence.app.options import CheckOptions

    monkeypatch.setattr(assembly, "open_driver", lambda cell, named: Robot(monkeypatch, pace=1.2))
    settings = [f"{key}={value}" for key, value in SETTINGS.items()]
    options = CheckOptions(
        cell="ur5",
        driver="socket:localhost:9",
        out=tmp_path / "out",
        settings=settings,
        as_json=True,
    )
    assert check(options) == 1
    answer = json.loads(capsys.readouterr().out)
    assert answer["command"] == "check"
    assert any(not each["holds"] for each in answer["checks"])
    assert "drift of the robot&#x27;s clock" in (tmp_path / "out" / "report.html").read_text()
