"""Arguments and options that several commands share."""

import os
from pathlib import Path
from typing import Annotated

import typer

from vergence.app import names
from vergence.errors import InputError


def folder_to_write(folder: Path | None) -> Path | None:
    """Return the folder that ``--out`` asks for, which may not exist yet.

    Raises:
        InputError: if it is a file, or cannot be made or written to.
    """
    if folder is None:
        return None
    there = next(path for path in (folder, *folder.absolute().parents) if path.exists())
    if there.is_dir() and os.access(there, os.W_OK | os.X_OK):
        return folder
    given = f"{folder}, which is a file" if folder.is_file() else f"{folder}, below {there}"
    raise InputError("--out", "", given, "a folder that can be written to")


Json = Annotated[bool, typer.Option("--json", help="Print one JSON object and nothing else.")]
Out = Annotated[
    Path | None,
    typer.Option(help="Folder to write to, instead of runs/NAME-TIME.", callback=folder_to_write),
]
Overwrite = Annotated[
    bool, typer.Option("--overwrite", help="Replace the recording that is in --out.")
]
CellName = Annotated[
    str,
    typer.Argument(
        help="Name of a built-in cell, a cell file or folder.", autocompletion=names.cells
    ),
]
Seed = Annotated[int | None, typer.Option(help="Random seed, instead of the cell's.")]
Images = Annotated[
    bool,
    typer.Option(
        "--images/--no-images", help="Track in rendered images, or use exact projections (faster)."
    ),
]
ImageEvery = Annotated[
    int, typer.Option(min=0, help="Record every n-th image of a camera; 0 records none.")
]
ImageQuality = Annotated[
    int, typer.Option(min=1, max=100, help="JPEG quality of the recorded images.")
]
Settings = Annotated[
    list[str] | None,
    typer.Option(
        "--set", metavar="KEY=VALUE", help="Replace a value of the cell file; may be repeated."
    ),
]
Driver = Annotated[
    str | None,
    typer.Option(
        metavar="NAME[:ADDRESS]",
        help="Run on a real robot with this driver: its name, or module:Class for your own.",
        autocompletion=names.drivers,
    ),
]
