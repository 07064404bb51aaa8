"""The options of `vergence track`."""

from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from vergence.app.options.shared import Json, Out


class Modality(StrEnum):
    """What of an object is followed."""

    AUTO = "auto"
    EDGES = "edges"
    OUTLINE = "outline"


@dataclass(frozen=True, kw_only=True)
class TrackOptions:
    """Which footage, what is followed in it, and how."""

    images: Annotated[str, typer.Argument(help="A folder of images, a video, or a ROS 2 bag.")]
    model: Annotated[str | None, typer.Option(help="The object: an OBJ, STL or MJCF file.")] = None
    tag: Annotated[
        str | None,
        typer.Option(
            metavar="DICTIONARY:ID:SIZE",
            help="Instead of --model: a marker, such as apriltag_36h11:7:0.05, its side in metres; "
            "it needs no --start.",
        ),
    ] = None
    curve: Annotated[
        list[str] | None,
        typer.Option(
            metavar="KIND:U,V,…",
            help="Instead of --model: a curve in the first image, in pixels; may be repeated. "
            "ellipse: one point inside, or five or more on it; line: two points on it; region: one "
            "point inside; mark: one point. It needs no camera.",
        ),
    ] = None
    start: Annotated[
        str | None,
        typer.Option(
            help="The object's pose in the camera, in the first image: "
            "x,y,z,roll,pitch,yaw in metres and degrees, or a TOML, JSON or YAML file."
        ),
    ] = None
    camera: Annotated[
        Path | None,
        typer.Option(help="Camera file with the intrinsics: TOML, JSON or YAML, including ROS's."),
    ] = None
    fx: Annotated[float | None, typer.Option("--fx", help="Focal length along u, in pixels.")] = (
        None
    )
    fy: Annotated[
        float | None, typer.Option("--fy", help="Focal length along v, in pixels. Default: --fx.")
    ] = None
    cx: Annotated[
        float | None, typer.Option("--cx", help="Principal point along u. Default: the middle.")
    ] = None
    cy: Annotated[
        float | None, typer.Option("--cy", help="Principal point along v. Default: the middle.")
    ] = None
    distortion: Annotated[
        str | None, typer.Option(help="Distortion k1,k2,p1,p2,k3. Default: none.")
    ] = None
    topic: Annotated[
        str | None, typer.Option(help="Topic of the images, if the bag has several.")
    ] = None
    rate: Annotated[float | None, typer.Option(help="Frame rate, in images per second.")] = None
    scale: Annotated[
        float, typer.Option(help="Metres per unit of the model file: 0.001 for millimetres.")
    ] = 1.0
    contrast: Annotated[
        float | None,
        typer.Option(
            help="Smallest step in grey levels that counts as an edge. Default: 5, or 15 for a "
            "curve."
        ),
    ] = None
    jolt: Annotated[
        float | None,
        typer.Option(
            help="Unpredicted motion to allow for, in pixels per image. Default: 3, or 20 for a "
            "curve."
        ),
    ] = None
    share: Annotated[
        float | None,
        typer.Option(
            help="Fraction of the edges, or of the outline, that must be found for an image to "
            "count; of an ellipse, that must be in view. Default: 0.5 of edges, 0.35 of an "
            "outline, 0.4 of an ellipse."
        ),
    ] = None
    by: Annotated[
        Modality,
        typer.Option(
            help="What to track: sharp edges, or the outline by its colours. Default: edges "
            "where most of the outline runs along them."
        ),
    ] = Modality.AUTO
    overlay: Annotated[
        bool,
        typer.Option("--overlay/--no-overlay", help="Write a film with what is found drawn in."),
    ] = True
    out: Out = None
    as_json: Json = False
