"""The options of `vergence watch`."""

from dataclasses import dataclass
from typing import Annotated

import typer

from vergence.app import names
from vergence.app.options.shared import (
    Driver,
    ImageEvery,
    Images,
    Json,
    Out,
    Overwrite,
    Seed,
    Settings,
)


@dataclass(frozen=True, kw_only=True)
class WatchOptions:
    """What is shown, and where the page is served."""

    source: Annotated[
        str,
        typer.Argument(
            metavar="CELL|RUN|BAG",
            help="Name of a built-in cell, a cell file or folder; or the folder of a run or bag.",
            autocompletion=names.cells,
        ),
    ]
    topic: Annotated[
        str | None, typer.Option(help="Topic of the images to show of a ROS 2 bag. Default: all.")
    ] = None
    out: Out = None
    overwrite: Overwrite = False
    seed: Seed = None
    images: Images = True
    image_every: ImageEvery = 5
    settings: Settings = None
    driver: Driver = None
    host: Annotated[
        str,
        typer.Option(help="Address to listen on. The default is reachable from this machine only."),
    ] = "127.0.0.1"
    port: Annotated[
        int | None,
        typer.Option(
            min=0, max=65535, help="Port to listen on. Default: 8230, or the next free one."
        ),
    ] = None
    browser: Annotated[
        bool, typer.Option("--browser/--no-browser", help="Open the page in the browser.")
    ] = True
    as_json: Json = False
