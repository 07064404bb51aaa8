"""The options of `vergence run`."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

from vergence.app.options.shared import (
    CellName,
    Driver,
    ImageEvery,
    ImageQuality,
    Images,
    Json,
    Out,
    Overwrite,
    Seed,
    Settings,
)


@dataclass(frozen=True, kw_only=True)
class RunOptions:
    """Which cell is run, on what, and where the run is recorded."""

    cell: CellName
    goal: Annotated[
        Path | None,
        typer.Option(
            metavar="PHOTO",
            help="Move to where this photograph was taken, using images only; see `vergence goal`.",
        ),
    ] = None
    points: Annotated[
        str | None,
        typer.Option(
            metavar="U,V U,V …",
            help="Track these pixels of the first image, whatever the cell's task is.",
        ),
    ] = None
    driver: Driver = None
    seed: Seed = None
    images: Images = True
    image_every: ImageEvery = 2
    image_quality: ImageQuality = 85
    settings: Settings = None
    out: Out = None
    overwrite: Overwrite = False
    as_json: Json = False
