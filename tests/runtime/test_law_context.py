"""What a law is told of a cell agrees with the world that the cell describes."""

import numpy as np
import pytest

from vergence.assembly import run_driver
from vergence.assembly.law_context import LawContext
from vergence.assembly.started_driver import StartedDriver
from vergence.cell import load_cell
from vergence.errors import InputError
from vergence.geometry import se3_inverse, so3_log
from vergence.simulation import SimulatedDriver

OFF = {"calibration_error_m": 0.02, "calibration_error_deg": 3.0}


def context_of(cell, points_px=None):
    driver = SimulatedDriver(cell, images=False)
    started = StartedDriver(driver, cell.watched)
    seen = {name: frame.truth.points_px for name, frame in started.frames.items()}
    return driver, LawContext.of(cell, started).with_points(points_px or seen)


def off_by(T, believed):
    """Distance (m) and angle (degrees) between two poses."""
    off = se3_inverse(T) @ believed
    turn = np.linalg.norm(so3_log(np.ascontiguousarray(off[:3, :3])))
    return np.linalg.norm(off[:3, 3]), np.rad2deg(turn)


@pytest.mark.parametrize("name", ["eye_to_hand", "ur5", "wrist_and_wall", "gantry"])
def test_the_arm_of_a_law_ends_in_the_camera_or_in_the_target_that_it_holds(name):
    driver, context = context_of(load_cell(name))
    world, q = driver.world, context.joints[context.cell.task.arm]
    T = world.target_pose() if context.is_fixed else world.camera_pose(context.camera_name)
    np.testing.assert_allclose(context.arm.forward_kinematics(q), T, atol=1e-12)


@pytest.mark.parametrize("name", ["eye_to_hand", "ur5", "wrist_and_wall"])
def test_depths_are_those_of_the_features_with_the_target_at_its_placement(name):
    driver, context = context_of(load_cell(name))
    for camera in context.points_px:
        depth = driver.first_frame(camera).truth.depth_m
        np.testing.assert_allclose(context.depth_m(camera, None), depth, atol=1e-12)
    np.testing.assert_array_equal(context.depth_m(camera, 0.7), np.full(len(depth), 0.7))


def test_depths_of_picked_features_are_those_of_the_targets_surface():
    picked = np.array([[319.5, 239.5], [400.0, 300.0]])
    driver, context = context_of(load_cell("puma560"), {"wrist": picked})
    assert np.isfinite(driver.anchor("wrist", picked)).all()
    depth = driver.first_frame("wrist").truth.depth_m
    np.testing.assert_allclose(context.depth_m("wrist", None), depth, atol=1e-9)


def test_no_depth_is_made_up_where_the_placement_implies_none():
    cell = load_cell("puma560", {"target.position_m": "[5.0, 5.0, 0.0]"})
    _, context = context_of(cell, {"wrist": np.array([[300.0, 200.0]])})
    with pytest.raises(InputError, match="a depth in metres"):
        context.depth_m("wrist", None)


@pytest.mark.parametrize(("name", "camera"), [("ur5", "wrist"), ("eye_to_hand", "stand")])
def test_the_true_camera_is_off_its_placement_by_its_calibration_error(name, camera):
    driver, context = context_of(load_cell(name).replace(cameras={camera: OFF}))
    believed = context.T_world_camera()
    if believed is None:
        believed = context.arm.forward_kinematics(context.joints["ur5"])
    assert off_by(driver.world.camera_pose(camera), believed) == pytest.approx((0.02, 3.0))


def test_the_true_target_is_off_its_placement_by_the_error_that_the_cell_states():
    cell = load_cell("ur5", {"perception.start_error_m": "0.03", "perception.start_error_deg": "5"})
    driver, context = context_of(cell)
    T = driver.world.target_pose()
    assert np.linalg.norm(T[:3, 3] - cell.target.position_m) == pytest.approx(0.03)
    assert off_by(T, context.model.target_pose())[1] == pytest.approx(5.0)


def test_a_driver_that_begins_late_starts_the_clock_of_the_run():
    cell = load_cell("puma560")
    driver = SimulatedDriver(cell, images=False)
    for _ in range(100):
        driver.step({})
    started = StartedDriver(driver, cell.watched)
    assert set(started.frames) == {"wrist"}
    for _ in range(50):  # the loop is being assembled
        driver.step({})
    first = started.read()
    assert first.time == first.joints["puma"].time == pytest.approx(0.3)  # the driver's own clock
    run = run_driver(cell.replace(duration_s=0.2), driver, [], False)
    assert run.cameras["wrist"].time[0] < 0.05  # the run's clock starts with it
    assert run.outcome.time == pytest.approx(0.2, abs=0.01)
