"""The options of `vergence plan`."""

from dataclasses import dataclass
from typing import Annotated

import typer

from vergence.app import names
from vergence.app.options.shared import Images, Json, Out, Seed, Settings


@dataclass(frozen=True, kw_only=True)
class PlanOptions:
    """Which cell is planned in, and how."""

    cell: Annotated[
        str,
        typer.Argument(
            help="Name of a built-in cell, a cell file or folder, with a task of kind reach.",
            autocompletion=names.cells,
        ),
    ]
    planner: Annotated[
        str | None,
        typer.Option(
            help="Planner, instead of the cell's: optimised or potential_field.",
            autocompletion=names.planners,
        ),
    ] = None
    out: Out = None
    seed: Seed = None
    images: Images = True
    settings: Settings = None
    as_json: Json = False
