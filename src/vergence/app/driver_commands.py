"""The commands that need a robot."""

from typing import Annotated

import typer

from vergence.app import names
from vergence.app.options import CellName, Json, Out, Settings


def register(app: typer.Typer) -> None:
    """Add the commands to the command line."""
    app.command(epilog="Example: vergence check my_cell.toml --driver ur:192.168.1.10")(check)


def check(
    cell: CellName,
    driver: Annotated[
        str,
        typer.Option(
            metavar="NAME[:ADDRESS]",
            help="The robot: a driver by its name, or module:Class of your own.",
            autocompletion=names.drivers,
        ),
    ],
    nudge_deg: Annotated[
        float, typer.Option(min=0.1, max=20, help="How far each joint is turned.")
    ] = 2.0,
    nudge_mm: Annotated[
        float, typer.Option(min=0.1, max=100, help="How far each joint that slides is moved.")
    ] = 5.0,
    out: Out = None,
    settings: Settings = None,
    as_json: Json = False,
) -> None:
    """Bring up a robot: check clocks, joints and images, then move each joint slowly to and fro.

    The arm moves at a tenth of its limits. No joint moves before everything at rest holds.
    """
    from vergence.app.bring_up import check as command

    raise typer.Exit(command(cell, driver, nudge_deg, nudge_mm, out, settings or (), as_json))
