"""Where a worker finds the cell."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from vergence.cell import Cell, load_cell
from vergence.cell.tasks import require_one_task
from vergence.experiments.goal import merged
from vergence.places import CELLS

_ONE_TASK = "one [task]: laws are compared at one task"


@dataclass(frozen=True, slots=True)
class CellSource:
    """A cell by name or file, read anew wherever a run is made.

    A built-in cell is found by every worker with vergence installed; a file has to lie at the same
    place on all of them.
    """

    name: str  # of a built-in cell, or an absolute path
    overrides: Mapping[str, str] = field(default_factory=dict)  # dotted keys and TOML values
    seed: int | None = None
    changes: Mapping[str, Any] = field(default_factory=dict)  # tables to replace after those

    @classmethod
    def of(
        cls, name_or_path: str | Path, overrides: Mapping[str, str], seed: int | None
    ) -> "CellSource":
        """Return the source of a cell; refuse what `load_cell` refuses, and several tasks."""
        cell = load_cell(name_or_path, overrides, seed)
        require_one_task(cell, _ONE_TASK)
        path = cell.path
        name = path.parent.name if path.parent.parent == CELLS.resolve() else str(path)
        return cls(name, dict(overrides), seed)

    @classmethod
    def changed(cls, cell: str | Path | Cell, changes: Mapping[str, Any]) -> "CellSource":
        """Return the source of a cell, given or by its name or file, with tables replaced."""
        if isinstance(cell, Cell):
            source = cls.of(cell.path, {}, None)
            require_one_task(cell, _ONE_TASK)
            given = cell.as_tables()
            return replace(source, changes=merged(given, changes))
        return replace(cls.of(cell, {}, None), changes=changes)

    def load(self) -> Cell:
        """Return the cell."""
        cell = load_cell(self.name, self.overrides, self.seed)
        return cell.replace(**self.changes) if self.changes else cell
