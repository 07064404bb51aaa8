"""The options of `vergence check`."""

from dataclasses import dataclass
from typing import Annotated

import typer

from vergence.app import names
from vergence.app.options.shared import CellName, Json, Out, Settings


@dataclass(frozen=True, kw_only=True)
class CheckOptions:
    """Which robot is brought up, and how far its joints are moved."""

    cell: CellName
    driver: Annotated[
        str | None,
        typer.Option(
            metavar="NAME[:ADDRESS]",
            help="Driver of the robot: its name, or module:Class for your own.",
            autocompletion=names.drivers,
        ),
    ] = None
    nudge_deg: Annotated[
        float, typer.Option(min=0.1, max=20, help="Angle by which to turn each joint, in degrees.")
    ] = 2.0
    nudge_mm: Annotated[
        float,
        typer.Option(
            min=0.1, max=100, help="Distance by which to move each prismatic joint, in mm."
        ),
    ] = 5.0
    out: Out = None
    settings: Settings = None
    as_json: Json = False
