"""The fit of latency, mounting and focal length to points that a moving camera saw."""

import numpy as np
import pytest

from vergence.camera import Camera
from vergence.cell import load_cell
from vergence.estimation import SelfCalibration, SelfCalibrator
from vergence.geometry import se3, so3_exp, so3_log
from vergence.simulation.cell_model import CellModel

MODEL = CellModel(load_cell("ur5"))
ARM, CAMERA, START = (
    MODEL.arm_to_camera("wrist"),
    MODEL.cameras["wrist"],
    MODEL.joint_position("ur5"),
)
LATE_S, FOCAL = 0.07, 1.02
E = se3(so3_exp(np.array([0.1, -0.12, 0.08])), np.array([0.015, -0.02, 0.016]))
AMPLITUDE = np.deg2rad([3.0, 3.0, 4.0, 8.0, 8.0, 12.0])


def seen(amplitude: np.ndarray, wrong: float = 0.0) -> SelfCalibration:
    """Swing the joints for ten seconds; a share of the points is tracked wrongly after five."""
    rng = np.random.default_rng(0)
    rates, phases = rng.uniform(1.3, 3.1, 6), rng.uniform(0, 6, 6)
    true = Camera(CAMERA.width, CAMERA.height, focal_px=CAMERA.fx * FOCAL)
    T = ARM.forward_kinematics(START)
    box = rng.uniform((-0.1, -0.08, 0.4), (0.1, 0.08, 0.5), (6, 3))
    points = box @ T[:3, :3].T + T[:3, 3]

    def joints(time: float) -> np.ndarray:
        return START + amplitude * (np.sin(rates * time + phases) - np.sin(phases))

    calibrator = SelfCalibrator(ARM, CAMERA)
    for time in np.arange(0.0, 10.0, 1 / 30):
        calibrator.joints(time, joints(time))
        T = ARM.forward_kinematics(joints(time - LATE_S)) @ E
        px = true.project((points - T[:3, 3]) @ T[:3, :3]) + rng.normal(0, 0.2, (6, 2))
        if time > 5.0:
            px[: round(6 * wrong)] += 90.0
        calibrator.image(time, px, np.ones(6, dtype=np.bool_))
    return calibrator.estimate(0.5)


@pytest.mark.parametrize("wrong", [0.0, 0.35])
def test_all_is_found_to_within_its_deviations_and_wrong_points_do_no_harm(wrong: float) -> None:
    found = seen(AMPLITUDE, wrong)
    assert found.told.all()
    off = so3_log(E[:3, :3].T @ found.T_believed_camera[:3, :3])
    assert np.rad2deg(np.linalg.norm(off)) < 0.1
    assert np.linalg.norm((found.T_believed_camera - E)[:3, 3]) < 0.0015
    assert abs(found.latency_s - LATE_S) < 0.0005
    assert abs(found.focal - FOCAL) < 0.003
    errors = np.array([found.latency_s - LATE_S, *off])
    assert (np.abs(errors) < 5.0 * found.deviations[:4]).all()


def test_a_camera_that_turns_about_one_axis_only_does_not_tell_its_place() -> None:
    found = seen(AMPLITUDE * np.array([0, 0, 0, 0, 0, 1.0]))
    assert found.told[0]
    assert not found.told[4:7].all()
    assert not found.told[7]


def test_a_camera_at_rest_tells_nothing() -> None:
    found = seen(np.zeros(6))
    assert not found
    assert found.reason.startswith("the image moved in ")
