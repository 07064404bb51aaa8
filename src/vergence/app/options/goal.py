"""The options of `vergence goal`."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

from vergence.app.options.shared import CellName, Driver, Json, Settings


@dataclass(frozen=True, kw_only=True)
class GoalOptions:
    """Where a photograph is taken, and what is kept with it."""

    cell: CellName
    out: Annotated[Path, typer.Option(help="Image file to write: .png or .jpg.")] = Path("goal.png")
    at: Annotated[
        str | None,
        typer.Option(
            metavar="DEG,DEG,…",
            help="Joint positions to photograph from, in simulation. Default: the start.",
        ),
    ] = None
    distance_m: Annotated[
        float | None,
        typer.Option(
            help="Approximate distance from camera to object, in metres, if known.",
            min=1e-6,
            max=1e3,
        ),
    ] = None
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Replace a photograph that is in --out.")
    ] = False
    settings: Settings = None
    driver: Driver = None
    as_json: Json = False
