"""From a cell to the parts of its loop."""

from vergence.assembly.follow import follow_parts
from vergence.assembly.parts import Parts
from vergence.assembly.reach import reach_parts
from vergence.assembly.track import track_parts
from vergence.cell import Cell
from vergence.cell.schema import FollowTable, ReachTable, TrackTable
from vergence.signals import Outcome
from vergence.simulation import SimulatedDriver


def assemble_parts(cell: Cell, driver: SimulatedDriver, images: bool) -> Parts | Outcome:
    """Choose perception, planner and law by the kind of the task and the kind of the law.

    Returns:
        The parts, or why the run ends before anything moves.

    Raises:
        InputError: if the cell cannot be run as it is written.
    """
    match cell.task:
        case TrackTable():
            return track_parts(cell, cell.task, driver, images)
        case FollowTable():
            return follow_parts(cell, cell.task, driver, images)
        case ReachTable():
            return reach_parts(cell, cell.task, driver, images)
