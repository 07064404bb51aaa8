"""A photograph: recognised in the first image, two views, and a plan, before the arm moves."""

from typing import Any

from harness import calls, row
from vergence.assembly.law_context import LawContext
from vergence.assembly.started_driver import StartedDriver
from vergence.assembly.tasks.photograph import make_approach
from vergence.cell import load_cell
from vergence.cell.schema import ReachTable
from vergence.planning import Trajectory
from vergence.simulation import SimulatedDriver


def run() -> list[dict[str, Any]]:
    """Time it on the images of 640 x 480 of the cell `photograph`."""
    cell = load_cell("photograph")
    task = cell.task
    assert isinstance(task, ReachTable)
    driver = StartedDriver(SimulatedDriver(cell), cell.watched)
    context, frame = LawContext.of(cell, driver), driver.frames[task.camera]
    assert isinstance(make_approach(context, task, driver).begin(frame), Trajectory)
    name = "match a photograph, two views, plan"
    begin = calls(lambda: make_approach(context, task, driver).begin(frame))
    return [row(name, begin, unit="s", value_aim=1.0, rounds=7, one_core=False)]
