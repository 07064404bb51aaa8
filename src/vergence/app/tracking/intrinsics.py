"""The camera that took the footage."""

from collections.abc import Mapping
from typing import Any

from vergence.camera import Camera, camera_of
from vergence.errors import NOTHING, InputError


def camera_of_options(
    values: Mapping[str, float | None], distortion: str | None, width: int, height: int
) -> Camera:
    """Make the camera that options describe; --fy is --fx and the centre the middle by default.

    Args:
        values: fx, fy, cx, cy, px.
        distortion: k1,k2,p1,p2,k3, or fewer of them.
        width: of the images.
        height: of the images.

    Raises:
        InputError: if --fx is missing, or a value does not suit the image.
    """
    source = "vergence track"
    if values["fx"] is None:
        raise InputError(source, "--fx", NOTHING, "a focal length in pixels, or --camera FILE")
    fx = values["fx"]
    table: dict[str, Any] = {
        "fx": fx,
        "fy": fx if values["fy"] is None else values["fy"],
        "cx": (width - 1) / 2 if values["cx"] is None else values["cx"],
        "cy": (height - 1) / 2 if values["cy"] is None else values["cy"],
    }
    if distortion is not None:
        table["distortion"] = distortion.replace(",", " ").split()
    return camera_of(table, width, height, source, "--")
