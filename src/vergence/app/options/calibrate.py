"""The options of `vergence calibrate`."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

from vergence.app import names
from vergence.app.options.shared import Driver, Json, Out, Settings


@dataclass(frozen=True, kw_only=True)
class CalibrateOptions:
    """Which images to calibrate from, of what board, and what to estimate."""

    images: Annotated[
        Path | None,
        typer.Argument(
            help="A folder of images, which may contain board.toml and poses.csv, or a ROS 2 bag."
        ),
    ] = None
    board: Annotated[
        str | None,
        typer.Option(
            metavar="CxR",
            help="Size of the board, such as 11x8: inner corners (or circles) per row x rows.",
        ),
    ] = None
    square_mm: Annotated[
        float | None,
        typer.Option(
            min=0.1, max=1e4, help="Side of a square, or distance between circles, in mm."
        ),
    ] = None
    marker_mm: Annotated[
        float | None,
        typer.Option(
            min=0.05, max=1e4, help="Side of a marker, in mm. Without it the board is a chessboard."
        ),
    ] = None
    dictionary: Annotated[
        str | None, typer.Option(help="Dictionary of the markers. Default: aruco_5x5_250.")
    ] = None
    pattern: Annotated[
        str | None,
        typer.Option(
            help="Pattern: squares (the default), circles, or asymmetric_circles (such as 4x11)."
        ),
    ] = None
    square_deviation: Annotated[
        float,
        typer.Option(
            "--square-deviation",
            metavar="PERCENT",
            help="Standard deviation of the size of a square, in percent: how accurately it was "
            "measured.",
        ),
    ] = 0.5
    poses: Annotated[
        Path | None,
        typer.Option(
            help="Poses of the flange in the arm's base: CSV with image, x_m, y_m, z_m, qw, qx, "
            "qy, qz; or tables named poses in TOML or JSON."
        ),
    ] = None
    topic: Annotated[
        str | None, typer.Option(help="Topic of the images, if the bag has several.")
    ] = None
    cell: Annotated[
        str | None,
        typer.Option(
            metavar="CELL",
            help="Cell of the arm, for a bag or --driver; poses are taken where the arm stops.",
            autocompletion=names.cells,
        ),
    ] = None
    joints: Annotated[
        str | None, typer.Option(help="Topic of the joint states, if the bag has several.")
    ] = None
    fixed: Annotated[
        bool, typer.Option("--fixed", help="The camera is fixed and the arm carries the board.")
    ] = False
    camera: Annotated[
        Path | None,
        typer.Option(
            help="Camera file, if the lens is known: then only the mounting is estimated."
        ),
    ] = None
    lens: Annotated[
        str, typer.Option(help="Distortion model to estimate: none, k1, k1k2, k1k2p1p2 or full.")
    ] = "full"
    base: Annotated[
        str | None,
        typer.Option(
            help="Pose of the arm's base in the world: x,y,z,roll,pitch,yaw in m and degrees."
        ),
    ] = None
    synthetic: Annotated[
        str | None,
        typer.Option(
            metavar="CELL", help="Render the images in this cell.", autocompletion=names.cells
        ),
    ] = None
    watch: Annotated[str | None, typer.Option(help="Camera of the cell that takes the images.")] = (
        None
    )
    chessboard: Annotated[
        bool, typer.Option("--chessboard", help="Make a chessboard instead of ChArUco.")
    ] = False
    image_count: Annotated[
        int,
        typer.Option(
            "--images",
            min=1,
            max=10_000,
            help="Number of images to render, or to take from a robot.",
        ),
    ] = 30
    projected: Annotated[
        bool, typer.Option("--projected", help="Project corners instead of rendering images.")
    ] = False
    noise_px: Annotated[
        float, typer.Option(min=0, max=100, help="Noise of the projected corners, in pixels.")
    ] = 0.1
    latency: Annotated[
        str | None,
        typer.Option(
            metavar="CELL",
            help="Measure the delays of the cell's images and servo; needs --driver.",
            autocompletion=names.cells,
        ),
    ] = None
    mounting: Annotated[
        str | None,
        typer.Option(
            metavar="CELL",
            help="Ask the robot where the cell's cameras are mounted; needs --driver.",
            autocompletion=names.cells,
        ),
    ] = None
    driver: Driver = None
    move: Annotated[
        bool,
        typer.Option("--move", help="Drive the arm to poses that show the board; asks first."),
    ] = False
    yes: Annotated[bool, typer.Option("--yes", help="Do not ask before --move moves the arm.")] = (
        False
    )
    write: Annotated[
        bool,
        typer.Option(
            "--write", help="Write what --latency or --mounting finds into the cell file."
        ),
    ] = False
    settings: Settings = None
    out: Out = None
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Replace a calibration that is in --out.")
    ] = False
    seed: Annotated[int, typer.Option(min=0, help="Random seed.")] = 0
    as_json: Json = False
