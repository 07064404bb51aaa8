"""What a law is told of a cell agrees with the world that the cell describes."""

import numpy as np
import pytest

from vergence.assembly.law_context import LawContext
from vergence.cell import load_cell
from vergence.errors import InputError
from vergence.geometry import se3_inverse, so3_log
from vergence.simulation import SimulatedDriver

OFF = {"calibration_error_m": 0.02, "calibration_error_deg": 3.0}


def context_of(cell, images=False):
    driver = SimulatedDriver(cell, images)
    points_px = {name: driver.first_frame(name).truth.points_px for name in cell.cameras}
    return driver, LawContext.of(cell, driver, points_px)


@pytest.mark.parametrize("name", ["eye_to_hand", "ur5", "wrist_and_wall", "gantry"])
def test_the_arm_of_a_law_ends_in_the_camera(name):
    driver, context = context_of(load_cell(name))
    T = driver.world.camera_pose(context.camera_name)
    if context.is_fixed:
        T = np.linalg.inv(driver.world.target_pose()) @ T
    np.testing.assert_allclose(context.arm.forward_kinematics(context.start), T, atol=1e-12)


@pytest.mark.parametrize("name", ["eye_to_hand", "ur5", "wrist_and_wall"])
def test_depths_are_those_of_the_features_with_the_target_at_its_placement(name):
    driver, context = context_of(load_cell(name))
    for camera in context.points_px:
        depth = driver.first_frame(camera).truth.depth_m
        np.testing.assert_allclose(context.depth_m(camera, None), depth, atol=1e-12)
    np.testing.assert_array_equal(context.depth_m(camera, 0.7), np.full(len(depth), 0.7))


def test_depths_of_picked_features_are_those_of_the_targets_surface():
    cell = load_cell("puma560")
    driver = SimulatedDriver(cell, images=False)
    centre = np.array([[319.5, 239.5], [400.0, 300.0]])
    on_board = driver.anchor("wrist", centre)
    depth = driver.first_frame("wrist").truth.depth_m
    assert np.isfinite(on_board).all()
    context = LawContext.of(cell, driver, {"wrist": centre})
    np.testing.assert_allclose(context.depth_m("wrist", None), depth, atol=1e-9)


def test_no_depth_is_made_up_where_the_placement_implies_none():
    cell = load_cell("puma560", {"target.position_m": "[5.0, 5.0, 0.0]"})
    context = LawContext.of(
        cell, SimulatedDriver(cell, images=False), {"wrist": np.array([[300.0, 200.0]])}
    )
    with pytest.raises(InputError, match="a depth in metres"):
        context.depth_m("wrist", None)


@pytest.mark.parametrize(("name", "camera"), [("ur5", "wrist"), ("eye_to_hand", "stand")])
def test_the_believed_camera_is_off_by_its_calibration_error(name, camera):
    driver, context = context_of(load_cell(name).replace(cameras={camera: OFF}))
    believed = context.T_world_camera()
    if believed is None:
        believed = context.arm.forward_kinematics(context.start)
    off = se3_inverse(driver.world.camera_pose(camera)) @ believed
    assert np.linalg.norm(off[:3, 3]) == pytest.approx(0.02)
    assert np.rad2deg(np.linalg.norm(so3_log(np.ascontiguousarray(off[:3, :3])))) == pytest.approx(
        3.0
    )
