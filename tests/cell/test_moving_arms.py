"""Arms that move by themselves, and a target that an arm holds."""

import numpy as np
import pytest

from vergence.cell import Cell, load_cell
from vergence.errors import InputError
from vergence.geometry import rpy_to_matrix, se3, se3_inverse
from vergence.simulation import SimulatedDriver

REST = [0.0, 0.0, 0.0]
# Smart SiX: θ, d, a, α of Denavit and Hartenberg from joint angles in Comau's convention.
D = (0.45, 0.0, 0.0, 0.64707, 0.0, 0.095)
A = (0.15, 0.59, 0.13, 0.0, 0.0, 0.0)
ALPHA = np.deg2rad([-90.0, 0.0, -90.0, 90.0, -90.0, 0.0])


def denavit_hartenberg(theta: float, d: float, a: float, alpha: float) -> np.ndarray:
    turn = rpy_to_matrix(np.array([theta, 0.0, 0.0]))
    tilt = rpy_to_matrix(np.array([0.0, 0.0, alpha]))
    return se3(turn, np.array([0.0, 0.0, d])) @ se3(tilt, np.array([a, 0.0, 0.0]))


@pytest.fixture(scope="module")
def cell() -> Cell:
    return load_cell("lippiello2005")


def moved(cell: Cell, seconds: float) -> SimulatedDriver:
    driver = SimulatedDriver(cell, images=False)
    while driver.time < seconds - 1e-9:
        driver.step({})
    driver.world.update()
    return driver


@pytest.mark.parametrize("seed", range(4))
def test_the_smart_six_has_its_denavit_hartenberg_kinematics(cell: Cell, seed: int) -> None:
    arm = SimulatedDriver(cell, images=False).world.arm_to_body("master")
    rng = np.random.default_rng(seed)
    q = rng.uniform(np.maximum(arm.q_min, -np.pi), np.minimum(arm.q_max, np.pi))
    theta = (q[0], q[1] - np.pi / 2, -(q[2] + np.pi / 2), q[3], q[4], q[5])
    T = np.eye(4)
    for row in zip(theta, D, A, ALPHA, strict=True):
        T = T @ denavit_hartenberg(*row)
    assert arm.forward_kinematics(q) == pytest.approx(T, abs=1e-7)


def test_the_second_arm_has_a_track_along_its_bases_y(cell: Cell) -> None:
    arm = SimulatedDriver(cell, images=False).arms["slave"]
    assert arm.joint_count == 7
    assert arm.chain.sliding.tolist() == [True] + [False] * 6
    q = np.zeros(7)
    along = arm.forward_kinematics(q + np.eye(7)[0])[:3, 3] - arm.forward_kinematics(q)[:3, 3]
    assert along == pytest.approx([0.0, -1.0, 0.0], abs=1e-9)  # its base is turned by 180 degrees


def test_the_carried_target_passes_its_waypoints(cell: Cell) -> None:
    motion = cell.arms["master"].motion
    start = moved(cell, 0.0).world.target_pose()
    there = moved(cell, motion.times_s[2]).world.target_pose()
    between = se3_inverse(start) @ there
    assert between[:3, 3] == pytest.approx(motion.positions_m[2], abs=5e-4)
    yaw_pitch_roll = np.deg2rad(motion.rotations_rpy_deg[2])[::-1]
    assert between[:3, :3] == pytest.approx(rpy_to_matrix(yaw_pitch_roll), abs=2e-3)


def test_setpoints_do_not_move_an_arm_that_moves_by_itself(cell: Cell) -> None:
    driver = SimulatedDriver(cell, images=False)
    held = driver.read().joints["master"].position
    guard = {"master": type("Still", (), {"position": held, "velocity": np.zeros(6)})()}
    while driver.time < 3.0:
        driver.step(guard)
    assert np.abs(driver.read().joints["master"].position - held).max() > 0.02


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"positions_m": [REST, [3.0, 0.0, 0.0]]}, "out of reach"),
        ({"times_s": [0.0, 0.05]}, "rad/s"),
        ({"times_s": [0.5, 1.0]}, "increase"),
        ({"times_s": [0.0, 1.0, 2.0]}, "as many"),
    ],
)
def test_a_motion_that_cannot_be_made_is_answered_with_its_key(
    cell: Cell, change: dict[str, object], said: str
) -> None:
    motion = {
        "kind": "poses",
        "times_s": [0.0, 1.0],
        "positions_m": [REST, [-0.3, 0.0, 0.0]],
        "rotations_rpy_deg": [REST, REST],
    }
    with pytest.raises(InputError, match=said) as caught:
        SimulatedDriver(
            cell.replace(arms={"master": {"motion": None}}).replace(
                arms={"master": {"motion": {**motion, **change}}}
            ),
            images=False,
        )
    assert "arms.master.motion" in caught.value.key


def test_a_blind_camera_sees_nothing_while_it_is_blind(cell: Cell) -> None:
    blind = cell.replace(cameras={"fixed": {"blind_s": [[0.1, 0.2]]}})
    driver = SimulatedDriver(blind, images=False)
    driver.look_for(np.array([[0.0, 0.0, 0.055]]))
    seen = []
    while driver.time < 0.4:
        frames = [frame for frame in driver.read().frames if frame.camera == "fixed"]
        seen += [(frame.time, bool(frame.truth.visible.any())) for frame in frames]
        driver.step({})
    assert all(visible == (not 0.1 <= time < 0.2) for time, visible in seen)
    assert any(not visible for _, visible in seen)
