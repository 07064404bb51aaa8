"""Arguments and options that several commands share."""

from pathlib import Path
from typing import Annotated

import typer

from vergence.app import names

Json = Annotated[bool, typer.Option("--json", help="Print one JSON object and nothing else.")]
Out = Annotated[Path | None, typer.Option(help="Folder to write to, instead of runs/NAME-TIME.")]
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
