"""The work cell as data: what a cell file says; nothing here simulates it."""

from vergence.cell.cell import Cell, load_cell
from vergence.places import built_in_cells

__all__ = ["Cell", "built_in_cells", "load_cell"]
