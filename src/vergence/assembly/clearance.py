"""What the task's arm of a cell must not touch, as its table `[collision]` says."""

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

from vergence.cell import Cell
from vergence.errors import InputError
from vergence.parts import kind_of
from vergence.signals import JointState

_MOST_PAIRS = 3  # that a message names

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
        InputError: if the arm's start is in collision, or a target that moves is to be avoided:
            where it is nobody knows for sure.
    """
    from vergence.simulation.clearance import CellClearance

    table = cell.collision
    moving = [n for n, target in cell.targets.items() if kind_of(target.motion) != "stationary"]
    if "target" in table.avoid and moving:
        given = f"target, with motion {kind_of(cell.targets[moving[0]].motion)}"
        raise InputError(str(cell.path), "collision.avoid", given, "a stationary target")
    name = cell.task.arm
    clearance = CellClearance(model, name, table.avoid, table.margin_m, states)
    if clearance.colliding:
        given = f"a start in collision: {'; '.join(clearance.colliding[:_MOST_PAIRS])}"
        allowed = f"a start without; collision.avoid ({', '.join(table.avoid)}) says what counts"
        raise InputError(str(cell.path), f"arms.{name}.start_deg", given, allowed)
    return clearance
