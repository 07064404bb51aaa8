"""Several targets in the simulated world: each moves by itself, and one hides the other."""

import numpy as np
import pytest

from vergence.cell import load_cell
from vergence.geometry import se3_inverse, transform_points
from vergence.signals import FrameTruth
from vergence.simulation import SimulatedDriver, placement_pose, target_pose
from vergence.simulation.obstacles import Obstacles

_EXACT = {"perception": {"start_error_m": 0.0, "start_error_deg": 0.0}}


@pytest.fixture
def driver() -> SimulatedDriver:
    return SimulatedDriver(load_cell("two_blocks").replace(**_EXACT), images=False)


def shown(driver: SimulatedDriver, camera: str) -> FrameTruth:
    truth = driver.first_frame(camera).truth
    assert truth is not None
    return truth


def test_each_moves_by_its_own_motion(driver: SimulatedDriver) -> None:
    while driver.time < 3.0:
        driver.step({})
    driver.world.update()
    truth = shown(driver, "left")
    poses = {"block": truth.T_world_target, "wedge": truth.others["wedge"].T_world_target}
    for name, table in driver.cell.targets.items():
        expected = target_pose(table, table.motion, driver.cell.seed)(driver.time)
        assert np.allclose(poses[name], expected, atol=1e-12)
        assert np.linalg.norm(expected[:3, 3] - table.position_m) > 0.01


def test_two_that_wander_do_not_wander_alike() -> None:
    wander = {"kind": "random", "amplitude_m": [0.1, 0.1, 0.1]}
    cell = load_cell("two_blocks").replace(
        targets={"block": {"motion": wander}, "wedge": {"motion": wander}}
    )
    driver = SimulatedDriver(cell, images=False)
    start = [driver.world.target_pose(name)[:3, 3] for name in cell.targets]
    for _ in range(1000):
        driver.step({})
    driver.world.update()
    now = [driver.world.target_pose(name)[:3, 3] for name in cell.targets]
    moved = np.subtract(now, start)
    assert min(np.linalg.norm(one) for one in moved) > 0.005
    assert np.linalg.norm(moved[0] - moved[1]) > 0.005


def test_each_is_off_its_placement_in_a_direction_of_its_own() -> None:
    cell = load_cell("two_blocks")
    driver = SimulatedDriver(cell, images=False)
    off = [
        driver.world.target_pose(name)[:3, 3] - placement_pose(table)[:3, 3]
        for name, table in cell.targets.items()
    ]
    assert np.allclose(np.linalg.norm(off, axis=1), 0.01)
    assert np.linalg.norm(off[0] - off[1]) > 1e-3


def test_what_one_hides_of_the_other_is_not_visible(driver: SimulatedDriver) -> None:
    world = driver.world
    before = shown(driver, "left").visible
    T_camera, T_block = world.camera_pose("left"), world.target_pose("block")
    near = T_block.copy()
    near[:3, 3] += 0.2 * (T_camera[:3, 3] - T_block[:3, 3])
    world.move_target(near, "wedge")
    world.update()
    hidden = before & ~shown(driver, "left").visible
    assert hidden.sum() >= 3
    obstacles = Obstacles(world)
    joints = {name: world.joint_position(name) for name in driver.arms}
    points = transform_points(T_block, driver.features)
    obstacles.move(joints, {"wedge": near})
    assert np.array_equal(obstacles.blocked(T_camera[:3, 3], points)[before], hidden[before])
    obstacles.move(joints)  # nobody knows where it is
    assert not obstacles.blocked(T_camera[:3, 3], points)[before].any()
    obstacles.move(joints, {"block": T_block})  # the target itself
    assert not obstacles.blocked(T_camera[:3, 3], points)[before].any()


def test_a_target_that_an_arm_carries_hides_from_where_it_is_believed() -> None:
    place = {"carried_by": "follower", "motion": {"kind": "stationary"}, "position_m": [0, 0, 0.2]}
    cell = load_cell("two_blocks").replace(targets={"wedge": place}, **_EXACT)
    world = SimulatedDriver(cell, images=False).world
    T_eye, T_block = world.camera_pose("left"), world.target_pose("block")
    T = T_block.copy()
    T[:3, 3] = 0.5 * (T_eye[:3, 3] + T_block[:3, 3])
    obstacles = Obstacles(world, "block")
    joints = {name: world.joint_position(name) for name in world.arms}
    for believed, blocked in ((T, True), (world.target_pose("wedge"), False)):
        obstacles.move(joints, {"wedge": believed})
        assert obstacles.blocked(T_eye[:3, 3], T_block[None, :3, 3])[0] == blocked


def test_a_gripper_takes_the_nearest() -> None:
    outputs = {"suction": {"arm": "follower", "reach_m": 0.5}}
    driver = SimulatedDriver(load_cell("two_blocks").replace(outputs=outputs), images=False)
    T_grip = driver.world.output_pose("suction")
    for name, away in (("block", 0.3), ("wedge", 0.2)):
        T = T_grip.copy()
        T[:3, 3] += (away, 0.0, 0.0)
        driver._motions[name] = lambda _, T=T: T  # type: ignore[misc]
    driver._move_targets()
    driver.set_output("suction", 1.0)
    q = {n: driver.world.joint_position(n) + 0.01 for n in driver.arms}
    driver.world.place(q)
    driver._move_targets()
    driver.world.update()
    moved = se3_inverse(T_grip) @ driver.world.output_pose("suction")
    held = se3_inverse(T_grip) @ driver.world.target_pose("wedge")
    assert np.linalg.norm(moved[:3, 3]) > 1e-3
    assert np.allclose(held, moved @ se3_inverse(T_grip) @ driver._motions["wedge"](0.0))
    assert np.allclose(driver.world.target_pose("block"), driver._motions["block"](0.0))
