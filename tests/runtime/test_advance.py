"""Straight motions by a distance, without images; ended by where the arm is or what it sees."""

import numpy as np
import pytest

from vergence.assembly import run_driver
from vergence.cell import load_cell
from vergence.errors import InputError
from vergence.geometry import se3_inverse, so3_log
from vergence.signals import OutcomeKind
from vergence.simulation import SimulatedDriver

ADVANCE = {"kind": "advance", "arm": "panda", "camera": "hand"}


class Watched(SimulatedDriver):
    """Keeps every set-point of the Panda that it is handed."""

    def __init__(self, cell):
        super().__init__(cell, images=False)
        self.setpoints = []

    def step(self, setpoints):
        self.setpoints.append(setpoints["panda"])
        super().step(setpoints)


def advanced(**task):
    """Run a task of a Panda; return run, driver, and the tip's poses at the set-points."""
    cell = load_cell("panda").replace(task={**ADVANCE, **task}, target={"motion": "stationary"})
    driver = Watched(cell)
    run = run_driver(cell, driver, (), images=False)
    arm = driver.world.arm_to_camera("hand")
    return run, driver, np.array([arm.forward_kinematics(s.position) for s in driver.setpoints])


@pytest.mark.parametrize(
    ("task", "axis"),
    [
        ({"distance_m": 0.12}, None),
        ({"distance_m": -0.15, "frame": "world", "axis": "x", "speed_m_s": 5.0}, (1, 0, 0)),
    ],
    ids=["along the optical axis", "as fast as the joints can"],
)
def test_the_tip_goes_straight_by_the_distance_and_does_not_turn(task, axis):
    run, driver, T = advanced(**task)
    assert run.outcome.kind is OutcomeKind.REACHED
    direction = T[0][:3, 2] if axis is None else np.array(axis)
    moved = T[:, :3, 3] - T[0][:3, 3]
    along = moved @ direction
    assert along[-1] == pytest.approx(task["distance_m"], abs=1e-4)
    assert np.linalg.norm(moved - along[:, None] * direction, axis=1).max() < 2e-4
    turned = [so3_log(np.ascontiguousarray(T[0][:3, :3].T @ one[:3, :3])) for one in T[::20]]
    assert np.abs(turned).max() < 1e-3
    rates = np.array([setpoint.velocity for setpoint in driver.setpoints])
    arm = driver.arms["panda"]
    assert (np.abs(rates) <= arm.rate_max * (1 + 1e-9)).all()
    changes = np.abs(np.diff(rates, axis=0)) * driver.inner_rate_hz
    assert (changes <= arm.acceleration_max * (1 + 1e-9)).all()
    speed = np.abs(np.diff(along)).max() * driver.inner_rate_hz
    assert speed <= task.get("speed_m_s", 0.1) * 1.01


@pytest.mark.parametrize(
    ("task", "word"),
    [({"distance_m": 2.0}, "m of 2.000 m"), ({"distance_m": -1.0, "axis": "x"}, "m of 1.000 m")],
)
def test_a_line_out_of_reach_is_refused_before_a_move(task, word):
    run, driver, _ = advanced(**task)
    assert run.outcome.kind is OutcomeKind.INFEASIBLE
    assert word in run.outcome.reason
    assert not driver.setpoints


def test_a_joint_that_passes_a_position_ends_it():
    until = {"kind": "joint", "joint": "panda_joint2", "above_deg": -20.0}
    run, driver, _ = advanced(distance_m=0.15, frame="world", axis="x", until=until)
    assert run.outcome.kind is OutcomeKind.REACHED
    assert run.outcome.reason.startswith("panda_joint2 is at")
    joint = run.arms["panda"].position[:, driver.arms["panda"].index("panda_joint2")]
    assert np.rad2deg(joint[-2:]) == pytest.approx([-20.0, -20.0], abs=1.0)


def test_a_place_of_the_camera_ends_it():
    _, _, T = advanced(distance_m=0.1)
    halfway = 0.5 * (T[0][:3, 3] + T[-1][:3, 3])
    until = {"kind": "pose", "position_m": halfway.tolist(), "tolerance_m": 0.01}
    run, _, T = advanced(distance_m=0.1, until=until)
    assert run.outcome.kind is OutcomeKind.REACHED
    assert run.outcome.reason.startswith("the camera is")
    assert np.linalg.norm(T[-1][:3, 3] - halfway) < 0.02


def test_a_distance_of_nothing_is_refused():
    with pytest.raises(InputError) as caught:
        load_cell("panda").replace(task={**ADVANCE, "distance_m": 0.0})
    assert caught.value.key == "task.distance_m"


def test_a_target_that_comes_into_view_ends_a_search():
    """The block is out of view where the arm begins; it looks for it on its way."""
    shared = {"arm": "ur5", "camera": "wrist"}
    cell = load_cell("pick")
    cell = cell.replace(
        arms={"ur5": {"start_deg": (-3.7, -95.0, 84.7, -79.8, -90.0, -108.7)}},
        tasks=[
            {**shared, "kind": "advance", "axis": "y", "distance_m": 0.25, "speed_m_s": 0.2},
            {**shared, "kind": "advance", "axis": "y", "distance_m": -0.25, "until": "seen"},
        ],
    )
    driver = SimulatedDriver(cell, images=False)
    run = run_driver(cell, driver, (), images=False)
    assert run.outcome.kind is OutcomeKind.REACHED
    away, search = run.outcome.tasks
    assert "features seen" in search.outcome.reason
    T_camera_target = se3_inverse(driver.world.camera_pose("wrist")) @ driver.world.target_pose()
    v = driver.cameras["wrist"].project(T_camera_target[None, :3, 3])[0, 1]
    assert 0 < v < 160  # it has just come in over the upper border
    assert away.outcome.kind is OutcomeKind.REACHED
