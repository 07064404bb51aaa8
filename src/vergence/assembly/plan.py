"""Plan a cell's path in the image, and move nothing."""

from pathlib import Path
from typing import Any

from vergence.assembly.law_context import LawContext
from vergence.assembly.run import changed_cell
from vergence.assembly.started_driver import StartedDriver
from vergence.assembly.tag import Located, located
from vergence.assembly.tasks.photograph import is_by_photograph, plan_approach
from vergence.assembly.tasks.reach import measure_twice, plan_reach
from vergence.assembly.tasks.tag_reach import plan_tag_reach
from vergence.cell import Cell
from vergence.cell.schema import ReachTable
from vergence.errors import InputError
from vergence.planning import Obstacle, PlanFailure
from vergence.planning import Path as PlannedPath
from vergence.simulation import SimulatedDriver
from vergence.vision.two_view import TwoViewFailure


def plan(
    cell: str | Path | Cell, *, images: bool = True, seed: int | None = None, **changes: Any
) -> PlannedPath | PlanFailure | TwoViewFailure:
    """Look at the target from the start and from the goal, and plan the path between the images.

    Args:
        cell: the name of a built-in cell, a cell file, a folder with one, or a cell; its task is to
            reach.
        images: match rendered images; if not, take exact projections.
        seed: replaces the cell's.
        **changes: values of the cell to replace; tables as dictionaries, as in its file.

    Returns:
        The path, or why there is none, which is false.

    Raises:
        InputError: if there is no such cell, or its task is another.
    """
    loaded = changed_cell(cell, seed, changes)
    if not isinstance(loaded.task, ReachTable):
        raise InputError(str(loaded.path), "task.kind", loaded.task.kind, "reach")
    driver = SimulatedDriver(loaded, images)
    try:
        started = StartedDriver(driver, loaded.watched)
        context = LawContext.of(loaded, started)
        if loaded.target.tag is not None:
            context, outcome = located(context, started) if images else Located(context, None)
            if outcome is not None:
                return PlanFailure(Obstacle.START, outcome.reason)
            return plan_tag_reach(context, loaded.task, started, images)
        if is_by_photograph(loaded):
            return plan_approach(context, loaded.task, started)
        pair = measure_twice(context, loaded.task, started, images)
        return pair if isinstance(pair, PlanFailure) else plan_reach(context, loaded.task, pair)
    finally:
        driver.close()
