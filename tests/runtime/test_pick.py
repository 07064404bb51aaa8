"""A pick as a cell: by photograph, by pose, straight down, suction on, straight up."""

import numpy as np
import pytest

import vergence as vg
from vergence.assembly import run_driver
from vergence.cell import load_cell
from vergence.errors import InputError
from vergence.runtime import DriverWrapper
from vergence.signals import OutcomeKind
from vergence.simulation import SimulatedDriver

SHARED = {"arm": "ur5", "camera": "wrist"}


class Watched(SimulatedDriver):
    """Keeps every set-point of the UR5 that it is handed."""

    def __init__(self, cell):
        super().__init__(cell)
        self.setpoints = []

    def step(self, setpoints):
        self.setpoints.append(setpoints["ur5"])
        super().step(setpoints)


def test_the_block_is_lifted_wherever_it_lies_and_no_limit_is_passed():
    cell = load_cell("pick")
    driver = Watched(cell)
    before = driver.world.target_pose()
    try:
        run = run_driver(cell, driver, (), images=True)
    finally:
        driver.close()
    assert run.outcome.kind is OutcomeKind.REACHED
    names = ["approach", "over the block", "down", "suction on", "up"]
    assert [task.name for task in run.outcome.tasks] == names
    assert all(task.outcome.kind is OutcomeKind.REACHED for task in run.outcome.tasks)
    lifted = driver.world.target_pose() @ np.linalg.inv(before)
    np.testing.assert_allclose(driver.world.target_pose()[:3, 3] - before[:3, 3], (0, 0, 0.15),
                               atol=1e-3)  # fmt: skip
    np.testing.assert_allclose(lifted[:3, :3], np.eye(3), atol=2e-3)
    # The photograph was taken before the block was moved to where it lies.
    assert np.linalg.norm(before[:3, 3] - cell.target.position_m) > 5e-3
    arm = driver.arms["ur5"]
    q = np.array([setpoint.position for setpoint in driver.setpoints])
    rates = np.array([setpoint.velocity for setpoint in driver.setpoints])
    assert (q >= arm.q_min).all()
    assert (q <= arm.q_max).all()
    assert (np.abs(rates) <= arm.rate_max * (1 + 1e-9)).all()
    changes = np.abs(np.diff(rates, axis=0)) * driver.inner_rate_hz
    assert (changes <= arm.acceleration_max * (1 + 1e-9)).all()
    np.testing.assert_allclose(np.diff(q, axis=0) * driver.inner_rate_hz, rates[1:], atol=1e-6)


def switched(*values):
    """Run a UR5 that switches its suction where it is, the cup at the block or not."""
    switch = {**SHARED, "kind": "switch", "output": "suction", "wait_s": 0.1}
    up = {**SHARED, "kind": "advance", "frame": "world", "distance_m": 0.05}
    tasks = [task for value in values for task in ({**switch, "value": value}, up)]
    return load_cell("pick").replace(tasks=tasks, perception={"start_error_m": 0.0})


def grip_height(cell):
    """Return the cell with the block at the cup."""
    driver = SimulatedDriver(cell, images=False)
    x, y, z = driver.world.output_pose("suction")[:3, 3]
    driver.close()
    return cell.replace(target={"position_m": (x, y, z - 1e-3)})


def test_a_block_that_is_let_go_stays_where_it_is():
    cell = grip_height(switched(1, 0))
    driver = SimulatedDriver(cell, images=False)
    before = driver.world.target_pose()
    run = run_driver(cell, driver, (), images=False)
    assert run.outcome.succeeded
    moved = driver.world.target_pose()[:3, 3] - before[:3, 3]
    np.testing.assert_allclose(moved, (0, 0, 0.05), atol=2e-3)
    assert [e.text for e in run.events if e.name == "output"] == [
        "suction set to 1", "suction set to 0"]  # fmt: skip


def test_a_gripper_that_closes_away_from_the_target_holds_nothing():
    cell = switched(1)
    driver = SimulatedDriver(cell, images=False)
    before = driver.world.target_pose()
    assert run_driver(cell, driver, (), images=False).outcome.succeeded
    np.testing.assert_allclose(driver.world.target_pose(), before, atol=1e-9)


class WithoutOutputs(DriverWrapper):
    """A driver that has none."""

    outputs = ()


class WithOthers(DriverWrapper):
    """A driver that has others."""

    outputs = ("lamp", "valve")


@pytest.mark.parametrize(
    ("wrapper", "names"), [(WithoutOutputs, "none"), (WithOthers, "lamp, valve")]
)
def test_a_driver_without_the_output_is_refused_before_anything_moves(wrapper, names):
    cell = switched(0, 1)
    driver = SimulatedDriver(cell, images=False)
    with pytest.raises(InputError) as caught:
        run_driver(cell, wrapper(driver), (), images=False)
    assert caught.value.key == "tasks.0.output"
    assert f"an output of the driver: {names}" in str(caught.value)
    assert driver.time == 0.0


@pytest.mark.parametrize(
    ("change", "key", "words"),
    [
        ({"output": "suktion"}, "tasks.0.output", "did you mean suction"),
        ({"value": 2}, "tasks.0.value", "at most 1"),
        ({"until": "seen"}, "tasks.0.until", "uses no images"),
    ],
)
def test_a_wrong_output_is_refused_by_key(change, key, words):
    task = {**SHARED, "kind": "switch", "output": "suction", "value": 1, **change}
    with pytest.raises(InputError) as caught:
        vg.run("pick", images=False, tasks=[task])
    assert caught.value.key == key
    assert words in str(caught.value)
