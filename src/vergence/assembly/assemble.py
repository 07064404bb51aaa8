"""From a cell and a driver to the parts of the loop."""

from typing import TYPE_CHECKING

import numpy as np

from vergence.assembly.follow import follow_parts
from vergence.assembly.law_context import LawContext
from vergence.assembly.parts import Parts
from vergence.assembly.photograph import is_by_photograph, photograph_parts
from vergence.assembly.reach import reach_parts
from vergence.assembly.started_driver import StartedDriver
from vergence.assembly.track import track_parts
from vergence.cell import Cell
from vergence.cell.schema import FollowTable, ReachTable, TrackTable
from vergence.errors import DriverSilent
from vergence.runtime.driver import Driver
from vergence.signals import Outcome, OutcomeKind

if TYPE_CHECKING:
    from vergence.simulation.cell_model import CellModel


def assemble_parts(
    cell: Cell, driver: Driver, images: bool = True, model: "CellModel | None" = None
) -> Parts | Outcome:
    """Choose perception, planner and law by the kind of the task and the kind of the law.

    Args:
        cell: what is to be done, and what is known of arms, cameras and target.
        driver: moves the arms and delivers the images.
        images: look through images; if not, at the exact projections of a simulated driver.
        model: of the cell, compiled already; it is placed at the start.

    Returns:
        The parts, or why the run ends before anything moves.

    Raises:
        InputError: if the cell cannot be run as it is written.
    """
    try:
        started = StartedDriver(driver, cell.watched)
    except DriverSilent as silence:
        return Outcome(OutcomeKind.DRIVER_SILENT, str(silence), 0.0)
    if started.missing:
        reason = f"no image from {', '.join(started.missing)} before the start"
        return Outcome(OutcomeKind.IMAGE_LATE, reason, 0.0)
    for name, q in started.joints.items():
        if not np.isfinite(q).all():
            reason = f"the joints of {name} are not finite before the start"
            return Outcome(OutcomeKind.BAD_SAMPLE, reason, 0.0)
    context = LawContext.of(cell, started, model)
    match cell.task:
        case TrackTable():
            return track_parts(context, cell.task, started, images)
        case FollowTable():
            return follow_parts(context, cell.task, started, images)
        case ReachTable() if is_by_photograph(cell):
            return photograph_parts(context, cell.task, started, images)
        case ReachTable():
            return reach_parts(context, cell.task, started, images)
