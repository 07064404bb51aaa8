"""A loop needs nothing of a driver but the protocol: no cell knows whether it is simulated."""

from importlib.resources import files

import cv2
import numpy as np
import pytest

from vergence.assembly import run_driver
from vergence.cell import load_cell
from vergence.cell.joint_positions import joint_positions
from vergence.errors import InputError
from vergence.signals import Frame, OutcomeKind, Sample
from vergence.simulation import SimulatedDriver

# All but one of several tasks, whose clock goes on while the next is put together.
CELLS = sorted({folder.name for folder in (files("vergence") / "cells").iterdir()} - {"pick"})


class Bare:
    """A driver reduced to the protocol, its frames to what a real camera knows."""

    sim_time = True

    def __init__(self, driver):
        self._driver = driver
        self.arms, self.cameras = driver.arms, driver.cameras
        self.inner_rate_hz = driver.inner_rate_hz

    def read(self):
        sample = self._driver.read()
        frames = tuple(Frame(f.camera, f.time, f.image, f.joints) for f in sample.frames)
        return Sample(sample.time, sample.joints, frames)

    def step(self, setpoints):
        self._driver.step(setpoints)

    def close(self):
        self._driver.close()


class Commands:
    """Keeps every command."""

    def begin(self, info):
        self.rates = []

    def tick(self, record):
        self.rates += [command.velocity for command in record.commands.values()]

    def event(self, time, name, text): ...

    def close(self, outcome, summary): ...


def with_goal_image(cell, folder):
    """The cell with its goal image in a file."""
    task = cell.task
    driver = SimulatedDriver(cell)
    goal = joint_positions(cell, "task.goal_deg", task.goal_deg, driver.arms[task.arm])
    cv2.imwrite(str(folder / "goal.png"), driver.frame_at(task.camera, task.arm, goal).image)
    driver.close()
    return cell.replace(task={"goal": str(folder / "goal.png")})


def run(cell, wrap):
    commands, driver = Commands(), SimulatedDriver(cell)
    try:
        outcome = run_driver(cell, wrap(driver), [commands], images=True).outcome
    finally:
        driver.close()
    return outcome, np.array(commands.rates)


@pytest.mark.parametrize("name", CELLS)
def test_every_cell_runs_alike_with_and_without_truth(name, tmp_path):
    cell = load_cell(name)
    if cell.task.kind == "reach":
        cell = cell if cell.task.goal else with_goal_image(cell, tmp_path)
    else:
        cell = cell.replace(duration_s=1.0)
    known, rates = run(cell, lambda driver: driver)
    bare, bare_rates = run(cell, Bare)
    assert known.succeeded
    if cell.name == "photograph":  # only a simulation waits for what is recognised on the way
        assert bare.kind is known.kind
        return
    assert bare == known
    np.testing.assert_array_equal(bare_rates, rates)


def test_without_a_goal_image_a_driver_that_cannot_take_one_is_refused():
    cell = load_cell("gantry")
    driver = SimulatedDriver(cell)
    with pytest.raises(InputError, match=r"task\.goal"):
        run_driver(cell, Bare(driver), [], images=True)
    driver.close()


def test_exact_projections_are_refused_to_a_driver_that_knows_none():
    cell = load_cell("ur5")
    with pytest.raises(InputError, match="truth"):
        run_driver(cell, Bare(SimulatedDriver(cell, images=False)), [], images=False)


def test_a_driver_that_never_delivers_an_image_ends_the_run_before_it_moves():
    class Blind(Bare):
        def read(self):
            sample = super().read()
            return Sample(sample.time, sample.joints, ())

    cell = load_cell("ur5")
    outcome = run_driver(cell, Blind(SimulatedDriver(cell)), [], images=True).outcome
    assert outcome.kind is OutcomeKind.IMAGE_LATE
    assert "wrist" in outcome.reason


def test_points_that_the_file_names_are_tracked_from_there():
    points = [[300.0, 200.0], [350.0, 260.0]]
    cell = load_cell("puma560", {"task.points_px": str(points), "duration_s": "0.2"})

    class First(Commands):
        def begin(self, info):
            self.desired = None

        def tick(self, record):
            self.desired = record.reference.points_px

    first, driver = First(), SimulatedDriver(cell)
    run_driver(cell, Bare(driver), [first], images=True)
    driver.close()
    np.testing.assert_array_equal(first.desired, points)
