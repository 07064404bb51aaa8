"""The camera that took the footage."""

from typing import Any

from vergence.app.options.track import TrackOptions
from vergence.app.tracking.footage import FootageFrame
from vergence.camera import Camera, camera_of, read_camera
from vergence.errors import NOTHING, InputError


def camera_of_options(options: TrackOptions, first: FootageFrame) -> Camera:
    """Return the camera that options describe; --fy is --fx and the centre the middle by default.

    Args:
        options: with a camera file, or intrinsics in pixels.
        first: image of the footage.

    Raises:
        InputError: if neither or both are given, or a value does not suit the image.
    """
    height, width = first.image.shape
    given = {key: getattr(options, key) for key in ("fx", "fy", "cx", "cy", "distortion")}
    if options.camera is not None:
        for key, value in given.items():
            if value is not None:
                raise InputError(
                    "vergence track", f"--{key}", value, "either --camera or intrinsics"
                )
        return read_camera(options.camera, width, height)
    source, fx = "vergence track", options.fx
    if fx is None:
        raise InputError(source, "--fx", NOTHING, "a focal length in pixels, or --camera FILE")
    table: dict[str, Any] = {
        "fx": fx,
        "fy": fx if options.fy is None else options.fy,
        "cx": (width - 1) / 2 if options.cx is None else options.cx,
        "cy": (height - 1) / 2 if options.cy is None else options.cy,
    }
    if options.distortion is not None:
        table["distortion"] = options.distortion.replace(",", " ").split()
    return camera_of(table, width, height, source, "--")
