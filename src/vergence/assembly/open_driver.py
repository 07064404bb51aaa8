"""The driver that a command names."""

from pathlib import Path
from typing import Any

from vergence.cell import Cell
from vergence.errors import InputError, VergenceError
from vergence.registry import find, kinds
from vergence.runtime import Driver


def open_driver(cell: Cell, named: str) -> Driver:
    """Return a driver for a cell.

    Args:
        cell: whose arms and cameras it drives.
        named: ``NAME``, or ``module:Class`` of one's own in a file beside the cell, in this folder
            or in an installed package; with ``:ADDRESS`` behind it where the driver takes one.

    Raises:
        InputError: if there is no such driver, or it cannot be opened.
    """
    first, _, rest = named.partition(":")
    if first in kinds("driver"):
        kind, address = first, rest
    else:
        name, _, address = rest.partition(":")
        kind = f"{first}:{name}" if name else first
    folder = cell.path.parent
    if not (folder / f"{first}.py").is_file():
        folder = Path.cwd()
    cls: Any = find("driver", kind, folder=folder, source="--driver", key="")
    try:
        driver: Driver = cls(cell, address)
    except VergenceError:
        raise
    except Exception as error:
        given = f"{named}, which raised {type(error).__name__}: {error}"
        raise InputError("--driver", "", given, "a driver that opens") from error
    return driver
