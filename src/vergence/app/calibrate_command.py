"""The options of `vergence calibrate`."""

from pathlib import Path
from typing import Annotated

import typer

from vergence.app import names
from vergence.app.options import Driver, Json, Out, Settings
from vergence.errors import InputError

_EXAMPLE = "vergence calibrate photos/ --board 11x8 --square-mm 20 --marker-mm 15"


def register(app: typer.Typer) -> None:
    """Add the command to the command line."""
    app.command(epilog=f"Example: {_EXAMPLE}")(calibrate)


def calibrate(
    images: Annotated[
        Path | None,
        typer.Argument(help="A folder of images; board.toml and poses.csv may lie in it."),
    ] = None,
    board: Annotated[
        str | None,
        typer.Option(metavar="CxR", help="Inner corners, or circles, in a row x rows, as 11x8."),
    ] = None,
    square_mm: Annotated[
        float | None, typer.Option(help="Side of a square, or distance of two circles.")
    ] = None,
    marker_mm: Annotated[
        float | None, typer.Option(help="Side of a marker; without it, a chessboard.")
    ] = None,
    dictionary: Annotated[
        str | None, typer.Option(help="Of the markers; aruco_5x5_250 if absent.")
    ] = None,
    pattern: Annotated[
        str | None,
        typer.Option(help="squares, circles or asymmetric_circles, as 4x11; squares if absent."),
    ] = None,
    square_deviation: Annotated[
        float,
        typer.Option(
            "--square-deviation",
            metavar="PERCENT",
            help="Standard deviation of the square's side: how well it was measured.",
        ),
    ] = 0.5,
    poses: Annotated[
        Path | None,
        typer.Option(
            help="Poses of the flange in the arm's base: CSV with image, x_m, y_m, z_m, qw, qx, "
            "qy, qz; or tables named poses in TOML or JSON."
        ),
    ] = None,
    fixed: Annotated[
        bool, typer.Option("--fixed", help="The camera is fixed and the arm carries the board.")
    ] = False,
    camera: Annotated[
        Path | None, typer.Option(help="The lens, if it is known: only the mounting is sought.")
    ] = None,
    lens: Annotated[
        str, typer.Option(help="Distortion to estimate: none, k1, k1k2, k1k2p1p2 or full.")
    ] = "full",
    base: Annotated[
        str | None,
        typer.Option(help="The arm's base in the world: x,y,z,roll,pitch,yaw in m and degrees."),
    ] = None,
    synthetic: Annotated[
        str | None,
        typer.Option(metavar="CELL", help="Make the images in a cell.", autocompletion=names.cells),
    ] = None,
    watch: Annotated[str | None, typer.Option(help="Which camera of the cell.")] = None,
    chessboard: Annotated[
        bool, typer.Option("--chessboard", help="Make a chessboard instead of ChArUco.")
    ] = False,
    image_count: Annotated[int, typer.Option("--images", min=1, help="How many to make.")] = 30,
    projected: Annotated[
        bool, typer.Option("--projected", help="Project corners instead of rendering images.")
    ] = False,
    noise_px: Annotated[float, typer.Option(min=0, help="Of projected corners.")] = 0.1,
    latency: Annotated[
        str | None,
        typer.Option(
            metavar="CELL",
            help="Measure how late the cell's images and servo are; needs --driver.",
            autocompletion=names.cells,
        ),
    ] = None,
    driver: Driver = None,
    settings: Settings = None,
    out: Out = None,
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Replace a calibration that is in --out.")
    ] = False,
    seed: Annotated[int, typer.Option(help="Random seed.")] = 0,
    as_json: Json = False,
) -> None:
    """Find a camera's lens, and where it is mounted, from images of a board.

    Images alone give the lens. With the arm's pose at each image, lens and mounting are
    refined together. With --latency an arm swings one joint by 2°, and the delay of the camera's
    images comes from their motion.
    """
    if latency is not None:
        from vergence.app.latency import latency as measure

        raise typer.Exit(measure(latency, driver, settings or (), as_json))
    for option, given in (("--driver", driver), ("--set", settings)):
        if given:
            raise InputError("calibrate", option, given, "it with --latency CELL")
    from vergence.app.calibrate import Request
    from vergence.app.calibrate import calibrate as command

    request = Request(
        images,
        board,
        square_mm,
        marker_mm,
        dictionary,
        pattern,
        square_deviation,
        poses,
        fixed,
        camera,
        lens,
        base,
        synthetic,
        watch,
        chessboard,
        image_count,
        projected,
        noise_px,
    )
    raise typer.Exit(command(request, out, overwrite, seed, as_json))
