"""What the task's arm of a cell must not touch, as its table `[collision]` says."""

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

from vergence.cell import Cell
from vergence.errors import InputError
from vergence.parts import kind_of
from vergence.signals import JointState

if TYPE_CHECKING:
    from vergence.simulation.cell_model import CellModel
    from vergence.simulation.clearance import CellClearance


def cell_clearance(
    cell: Cell, model: "CellModel", states: Callable[[], Mapping[str, JointState]]
) -> "CellClearance":
    """Return the distances of a cell's arm from what it must not touch.

    Args:
        cell: the cell.
        model: of the cell, its arms at their start.
        states: gives the joints of all arms now, by name.

    Raises:
        InputError: if a target that moves is to be avoided: where it is nobody knows for sure.
    """
    from vergence.simulation.clearance import CellClearance

    table = cell.collision
    moving = [n for n, target in cell.targets.items() if kind_of(target.motion) != "stationary"]
    if "target" in table.avoid and moving:
        given = f"target, with motion {kind_of(cell.targets[moving[0]].motion)}"
        raise InputError(str(cell.path), "collision.avoid", given, "a stationary target")
    return CellClearance(model, cell.task.arm, table.avoid, table.margin_m, states)
