"""Ordinary servoing beside a stationary target tells latency, mounting and focal length."""

from dataclasses import replace

import numpy as np

from vergence.assembly import assemble_parts, run_driver
from vergence.assembly.parts import Parts
from vergence.assembly.self_calibrating import SELF_CALIBRATION, SelfCalibrating, words
from vergence.cell import load_cell
from vergence.estimation import SelfCalibration
from vergence.geometry import se3, se3_inverse, so3_exp, transform_points
from vergence.runtime import Loop
from vergence.runtime.driver_wrapper import DriverWrapper
from vergence.signals import Reference, Sample
from vergence.simulation import SimulatedDriver

LATE_S = 0.04


class LateStamps(DriverWrapper):
    def read(self) -> Sample:
        sample = self.driver.read()
        late = tuple(replace(f, time=min(f.time + LATE_S, sample.time)) for f in sample.frames)
        return replace(sample, frames=late)


class Views:
    """Asks for one view of the features after another, two seconds each."""

    def __init__(self, driver: SimulatedDriver, start: np.ndarray) -> None:
        world = driver.world
        T_camera_target = se3_inverse(world.camera_pose("wrist")) @ world.target_pose()
        turns = [(0, 0, 0.3), (0.25, 0, -0.3), (-0.25, 0.1, 0.2), (0, -0.25, -0.2), (0.1, 0.25, 0)]
        self.desired = [start]
        for turn in turns:
            T = se3(so3_exp(np.array(turn)), np.zeros(3)) @ T_camera_target
            T[:2, 3], T[2, 3] = 0.0, T_camera_target[2, 3]
            points = transform_points(T, driver.features)
            self.desired.append(driver.cameras["wrist"].project(points))

    def reference(self, time: float) -> Reference:
        return Reference(time, self.desired[min(int(max(time, 0.0) / 2.0), len(self.desired) - 1)])


def servoed(error_deg: float, error_m: float, seconds: float) -> tuple[SelfCalibration, np.ndarray]:
    """Servo for a while with a camera that is not where it is believed; return also the truth."""
    cell = load_cell(
        "ur5",
        {
            "target.motion": "stationary",
            "cameras.wrist.calibration_error_deg": str(error_deg),
            "cameras.wrist.calibration_error_m": str(error_m),
            "cameras.wrist.latency_frames": "2",
            "law.gain": "2.0",
        },
    )
    simulated = SimulatedDriver(cell, images=False)
    parts = assemble_parts(cell, LateStamps(simulated), images=False)
    assert isinstance(parts, Parts)
    assert SelfCalibrating.suits(parts.context)
    found = SelfCalibrating(parts.context)
    start = parts.context.points_px["wrist"]
    loop = Loop(
        parts.driver,
        "ur5",
        parts.perception,
        Views(simulated, start),
        parts.law,
        outer_rate_hz=cell.outer_rate_hz,
        listeners=[found],
    )
    assert loop.run(seconds).succeeded
    believed = parts.context.arm_to_camera("wrist").forward_kinematics(
        simulated.world.joint_position("ur5")
    )
    simulated.world.update()
    return found.estimate(), se3_inverse(believed) @ simulated.world.camera_pose("wrist")


def test_servoing_finds_ten_degrees_and_three_centimetres_within_ten_seconds() -> None:
    found, truth = servoed(10.0, 0.03, 10.0)
    assert found.told.all(), words(found)
    off = se3_inverse(truth) @ found.T_believed_camera
    assert np.rad2deg(np.arccos((np.trace(off[:3, :3]) - 1) / 2)) < 0.3
    assert np.linalg.norm((found.T_believed_camera - truth)[:3, 3]) < 0.002
    assert abs(found.latency_s - LATE_S) < 0.003
    assert abs(found.focal - 1.0) < 0.005
    said = words(found)
    assert "stamps 4" in said
    assert "too little" not in said


def test_a_run_tells_it_at_its_end() -> None:
    cell = load_cell("ur5", {"target.motion": "stationary", "duration_s": "1"})
    driver = SimulatedDriver(cell, images=False)
    run = run_driver(cell, driver, (), False, self_calibration=True)
    (told,) = [event for event in run.events if event.name == SELF_CALIBRATION]
    assert told.text.startswith(
        "the run does not determine the camera's parameters: the image moved in "
    )
    moving = load_cell("ur5", {"duration_s": "0.2"})
    driver = SimulatedDriver(moving, images=False)
    run = run_driver(moving, driver, (), False, self_calibration=True)
    assert not [event for event in run.events if event.name == SELF_CALIBRATION]


def test_too_little_motion_is_said() -> None:
    found, _ = servoed(0.0, 0.0, 1.0)
    assert not found
    assert "does not determine" in words(found) or "too little motion" in words(found)
