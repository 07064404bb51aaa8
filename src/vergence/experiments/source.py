"""Where a worker finds the cell."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from vergence.cell import Cell, load_cell
from vergence.places import CELLS


@dataclass(frozen=True, slots=True)
class CellSource:
    """A cell by name or file, read anew wherever a run is made.

    A built-in cell is found by every worker with vergence installed; a file has to lie at the same
    place on all of them.
    """

    name: str  # of a built-in cell, or an absolute path
    overrides: Mapping[str, str] = field(default_factory=dict)  # dotted keys and TOML values
    seed: int | None = None

    @classmethod
    def of(
        cls, name_or_path: str | Path, overrides: Mapping[str, str], seed: int | None
    ) -> "CellSource":
        """Return the source of a cell; refuse what `load_cell` refuses."""
        path = load_cell(name_or_path, overrides, seed).path
        name = path.parent.name if path.parent.parent == CELLS.resolve() else str(path)
        return cls(name, dict(overrides), seed)

    def load(self) -> Cell:
        """Return the cell."""
        return load_cell(self.name, self.overrides, self.seed)
