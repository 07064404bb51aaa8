"""Run a cell from Python: by its name, with some of its values changed."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from vergence.assembly.run_cell import run_cell
from vergence.cell import Cell, load_cell
from vergence.runtime import Listener, Run


def run(
    cell: str | Path | Cell,
    *,
    images: bool = True,
    seed: int | None = None,
    listeners: Sequence[Listener] = (),
    **changes: Any,
) -> Run:
    """Run a cell in simulation and return what the run was.

    ``run("puma560", duration_s=2, target=dict(motion=dict(velocity_m_s=[0.2, 0, 0])))`` is what
    ``vergence run puma560 --set duration_s=2 --set 'target.motion.velocity_m_s=[0.2, 0, 0]'`` runs.

    Args:
        cell: the name of a built-in cell, a cell file, a folder with one, or a cell.
        images: measure in rendered images; if not, take exact projections.
        seed: of everything that is drawn by chance; replaces the cell's.
        listeners: hear of every tick, such as a `Recorder`.
        **changes: values of the cell to replace; tables as dictionaries, as in its file.

    Raises:
        InputError: if there is no such cell, or it cannot be run as it is changed.
        RenderingError: if there is nothing to render with.
    """
    return run_cell(changed_cell(cell, seed, changes), listeners, images)


def changed_cell(cell: str | Path | Cell, seed: int | None, changes: dict[str, Any]) -> Cell:
    """Return a cell, given or by its name or file, with some of its values replaced."""
    loaded = cell if isinstance(cell, Cell) else load_cell(cell)
    if seed is not None:
        changes = {**changes, "seed": seed}
    return loaded.replace(**changes) if changes else loaded
