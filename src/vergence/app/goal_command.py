"""The options of `vergence goal`."""

from pathlib import Path
from typing import Annotated

import typer

from vergence.app.options import CellName, Driver, Json, Settings


def register(app: typer.Typer) -> None:
    """Add the command to the command line."""
    app.command(epilog="Example: vergence goal ur5 --at 0,-100,100,-90,-90,30 --out goal.png")(goal)


def goal(
    cell: CellName,
    out: Annotated[Path, typer.Option(help="The photograph: .png or .jpg.")] = Path("goal.png"),
    at: Annotated[
        str | None,
        typer.Option(
            metavar="DEG,DEG,…",
            help="Joint positions to take it from, in simulation; the start's if absent.",
        ),
    ] = None,
    distance_m: Annotated[
        float | None, typer.Option(help="From camera to object, if you know it roughly.", min=1e-6)
    ] = None,
    settings: Settings = None,
    driver: Driver = None,
    as_json: Json = False,
) -> None:
    """Take a photograph to go back to: the image, its camera file and the joints beside it."""
    from vergence.app.goal import Request
    from vergence.app.goal import goal as command

    request = Request(cell, out, at, distance_m, settings or (), driver)
    raise typer.Exit(command(request, as_json))
