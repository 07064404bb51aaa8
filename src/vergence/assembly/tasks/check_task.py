"""What can be known of every task of a cell before anything moves."""

from dataclasses import replace

from vergence.assembly.build_law import require_suitable
from vergence.assembly.law_context import LawContext
from vergence.assembly.target_geometry import target_shape
from vergence.assembly.tasks.photograph import is_by_photograph, require_photograph
from vergence.assembly.tasks.switch import require_output
from vergence.assembly.tasks.task_stages import until_of
from vergence.cell import Cell
from vergence.cell.schema import AdvanceTable, FollowTable, ReachTable, SwitchTable
from vergence.control import ServoSettings
from vergence.errors import InputError
from vergence.runtime.driver import Driver
from vergence.runtime.task_ends import looks_for_target


def check_task(cell: Cell, context: LawContext, driver: Driver, images: bool) -> None:
    """Refuse a task that cannot be done wherever the arm is when it begins.

    Args:
        cell: with that task alone.
        context: of another task of the same cell.
        driver: of the cell.
        images: whether the tasks look through images.

    Raises:
        InputError: if it cannot be run as it is written.
    """
    context = replace(context, cell=cell)
    until_of(context)
    require_output(cell, driver)
    if is_by_photograph(cell):
        require_photograph(context, images)
    elif isinstance(cell.task, ReachTable) and cell.task.finish != "points":
        allowed = "points; luminance only finishes a photograph without known features"
        raise InputError(str(cell.path), "task.finish", cell.task.finish, allowed)
    if isinstance(cell.task, FollowTable) or looks_for_target(cell.task.until):
        target_shape(cell, context.model)
    moves_by_law = not isinstance(cell.task, AdvanceTable | SwitchTable)
    if moves_by_law and isinstance(cell.law, ServoSettings):
        require_suitable(cell)
