"""The options of `vergence new`."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

from vergence.app.options.shared import Json, folder_to_write


@dataclass(frozen=True, kw_only=True)
class NewOptions:
    """For which arm a cell is written, and with what camera and target."""

    model: Annotated[
        str, typer.Argument(help="URDF or MJCF file of the arm; or package:NAME/PATH.")
    ]
    body: Annotated[
        str,
        typer.Option(
            help="Last body of the arm; the camera is mounted on it. `list` names all bodies."
        ),
    ] = ""
    out: Annotated[
        Path | None,
        typer.Option(
            help="Folder to write to. Default: the model's name.", callback=folder_to_write
        ),
    ] = None
    camera: Annotated[
        Path | None, typer.Option(help="Camera file with the lens, as `calibrate` writes it.")
    ] = None
    target: Annotated[
        Path | None,
        typer.Option(help="Mesh of the target, OBJ or STL. Default: a speckled board."),
    ] = None
    target_scale: Annotated[
        float,
        typer.Option(min=1e-6, max=1e3, help="Metres per unit of the mesh: 0.001 for millimetres."),
    ] = 1.0
    as_json: Json = False
