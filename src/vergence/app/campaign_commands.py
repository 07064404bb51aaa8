"""The options of `vergence compare` and `vergence map`."""

import math
from pathlib import Path
from typing import Annotated

import typer

from vergence.app import names
from vergence.app.options import CellName, Json, Settings
from vergence.errors import InputError, nearest
from vergence.places import find_cell

_Out = Annotated[
    Path | None,
    typer.Option(help="Folder to write to, instead of runs/NAME-TIME; goes on with what is there."),
]
_Tolerance = Annotated[
    float, typer.Option(min=0.0, help="Converged: every feature this near at the end, px.")
]
_Workers = Annotated[
    int | None, typer.Option(min=1, help="Processes of this machine; one a core if absent.")
]
_Scheduler = Annotated[
    str | None,
    typer.Option(metavar="ADDRESS", help="A Dask scheduler, whose workers run it instead."),
]
_Physics = Annotated[
    bool,
    typer.Option("--physics", help="Simulate physics too: slower, with servos that lag."),
]


def register(app: typer.Typer) -> None:
    """Add the two commands to the command line."""

    @app.command(
        epilog="Example: vergence compare panda --laws image_based,constrained --starts 40"
    )
    def compare(
        cell: CellName,
        laws: Annotated[
            str | None,
            typer.Option(
                help="Names, with commas between: own (the cell's law), a name in the file's laws, "
                "image_based, image_based_desired, image_based_mean, optimal_tracking, "
                "constrained, constrained_tracking. If absent, own and the file's laws.",
                autocompletion=names.laws,
            ),
        ] = None,
        starts: Annotated[int, typer.Option(min=1, help="How many, for each law.")] = 20,
        vary: Annotated[
            str,
            typer.Option(help="What is drawn, with commas between: starts, targets, motions."),
        ] = "starts",
        seed: Annotated[int, typer.Option(min=0, help="Random seed.")] = 0,
        spread: Annotated[
            float,
            typer.Option(
                min=0.0,
                max=1.0,
                help="Of starts, share of a joint's range; of targets, of their distance.",
            ),
        ] = 0.2,
        speed: Annotated[
            float, typer.Option(min=0.0, help="Of the fastest motion that is drawn, m/s.")
        ] = 0.1,
        tolerance_px: _Tolerance = 2.0,
        workers: _Workers = None,
        scheduler: _Scheduler = None,
        physics: _Physics = False,
        out: _Out = None,
        settings: Settings = None,
        as_json: Json = False,
    ) -> None:
        """Run several laws from the same random draws: one table, and where each fails."""
        find_cell(cell)  # a mistake is told before all is loaded
        from vergence.app.campaign import prepare
        from vergence.app.compare import compare as command

        source, how = prepare(
            "compare", cell, settings or (), out, tolerance_px, workers, scheduler, physics
        )
        from vergence.experiments import Sampling

        named = () if laws is None else _names("--laws", laws)
        sampling = Sampling(_names("--vary", vary), spread, speed)
        raise typer.Exit(command(source, named, starts, seed, sampling, how, as_json))

    @app.command(
        name="map", epilog="Example: vergence map puma560 --over headings --speeds 0.1,0.2"
    )
    def map_region(
        cell: CellName,
        over: Annotated[
            str,
            typer.Option(
                help="places: the target goes to points of a square; or headings.",
                autocompletion=names.over,
            ),
        ] = "places",
        extent: Annotated[
            float, typer.Option(min=0.0, help="Half a side of the square, or the way, in m.")
        ] = 0.5,
        steps: Annotated[
            int, typer.Option(min=2, help="Points along a side, or directions all around.")
        ] = 11,
        speeds: Annotated[
            str, typer.Option(help="Of the target, m/s, with commas; places take the first.")
        ] = "0.1",
        laws: Annotated[
            str,
            typer.Option(
                help="One or several, as for `vergence compare`.", autocompletion=names.laws
            ),
        ] = "own",
        tolerance_px: _Tolerance = 2.0,
        workers: _Workers = None,
        scheduler: _Scheduler = None,
        physics: _Physics = False,
        out: _Out = None,
        settings: Settings = None,
        as_json: Json = False,
    ) -> None:
        """Map where a cell's law works: how far it follows the target, and what ends it."""
        if over not in names.OVER:
            raise InputError("--over", "", over, nearest(over, names.OVER))
        if not 0 < extent < math.inf:
            raise InputError("--extent", "", extent, "above zero, in m")
        find_cell(cell)  # a mistake is told before all is loaded
        from vergence.app.campaign import prepare
        from vergence.app.map_region import Region
        from vergence.app.map_region import map_region as command

        region = Region(over, extent, steps, _speeds(speeds), _names("--laws", laws))
        source, how = prepare(
            "map", cell, settings or (), out, tolerance_px, workers, scheduler, physics
        )
        raise typer.Exit(command(source, region, how, as_json))


def _names(option: str, text: str) -> tuple[str, ...]:
    given = tuple(dict.fromkeys(name.strip() for name in text.split(",") if name.strip()))
    if not given:
        raise InputError(option, "", text, "names with commas between")
    return given


def _speeds(text: str) -> tuple[float, ...]:
    try:
        speeds = tuple(float(word) for word in text.split(","))
    except ValueError:
        speeds = ()
    if not speeds or not all(0 < speed < math.inf for speed in speeds):
        raise InputError("--speeds", "", text, "numbers above zero with commas between, in m/s")
    return speeds
