"""The camera that took the footage."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from vergence.app.tracking.tables import numbers, read_table, require_known
from vergence.camera import Camera
from vergence.errors import InputError

_OWN = ("width", "height", "fx", "fy", "cx", "cy", "distortion")
_OPTIONS = ("fx", "fy", "cx", "cy")


def camera_of_options(
    values: Mapping[str, float | None], distortion: str | None, width: int, height: int
) -> Camera:
    """Make the camera that options describe; --fy is --fx and the centre the middle by default.

    Args:
        values: fx, fy, cx, cy, px.
        distortion: k1,k2,p1,p2,k3, or fewer of them.
        width: of the pictures.
        height: of the pictures.

    Raises:
        InputError: if --fx is missing, or a value does not suit the picture.
    """
    source = "vergence track"
    if values["fx"] is None:
        raise InputError(source, "--fx", "nothing", "a focal length in pixels, or --camera FILE")
    fx = values["fx"]
    table: dict[str, Any] = {
        "fx": fx,
        "fy": fx if values["fy"] is None else values["fy"],
        "cx": (width - 1) / 2 if values["cx"] is None else values["cx"],
        "cy": (height - 1) / 2 if values["cy"] is None else values["cy"],
    }
    if distortion is not None:
        table["distortion"] = distortion.replace(",", " ").split()
    return _checked(table, width, height, source, "--")


def camera_of_file(path: Path, width: int, height: int) -> Camera:
    """Read a camera file: our own keys, or those of ROS's camera_info.

    Ours are width, height, fx, fy, cx, cy and distortion (k1, k2, p1, p2, k3); ROS's are
    image_width, image_height, camera_matrix and distortion_coefficients.

    Raises:
        InputError: if it cannot be read or does not suit pictures of this size.
    """
    source = str(path)
    table = read_table(path, "a camera")
    if "camera_matrix" in table:
        table = _from_ros(table, source)
    require_known(table, _OWN, source)
    for key, have in (("width", width), ("height", height)):
        if key in table and float(numbers(table, key, (), source)) != have:
            raise InputError(
                source, key, f"{table[key]:g}", f"{have}: the pictures are {width} x {height}"
            )
    return _checked(table, width, height, source, "")


def _from_ros(table: Mapping[str, Any], source: str) -> dict[str, Any]:
    matrix = table["camera_matrix"]
    if isinstance(matrix, Mapping):
        matrix = matrix.get("data", ())
    flat = numbers({"camera_matrix": np.ravel(matrix)}, "camera_matrix", (9,), source)
    own: dict[str, Any] = {"fx": flat[0], "fy": flat[4], "cx": flat[2], "cy": flat[5]}
    for theirs, ours in (("image_width", "width"), ("image_height", "height")):
        if theirs in table:
            own[ours] = table[theirs]
    model = table.get("distortion_model", "plumb_bob")
    if model != "plumb_bob":
        raise InputError(source, "distortion_model", model, "plumb_bob")
    if "distortion_coefficients" in table:
        coefficients = table["distortion_coefficients"]
        data = coefficients.get("data", ()) if isinstance(coefficients, Mapping) else coefficients
        own["distortion"] = np.ravel(data)
    return own


def _checked(table: Mapping[str, Any], width: int, height: int, source: str, prefix: str) -> Camera:
    named = {prefix + key: value for key, value in table.items()}
    given = {key: float(numbers(named, prefix + key, (), source)) for key in _OPTIONS}
    for key in ("fx", "fy"):
        if not 0.1 * width <= given[key] <= 100.0 * width:
            allowed = f"a focal length in pixels; the pictures are {width} x {height}"
            raise InputError(source, prefix + key, given[key], allowed)
    if not 0.5 <= given["fx"] / given["fy"] <= 2.0:
        raise InputError(source, prefix + "fy", given["fy"], f"similar to fx, {given['fx']:g}")
    for key, side in (("cx", width), ("cy", height)):
        if not 0.0 <= given[key] <= side - 1:
            allowed = f"0 … {side - 1}: the pictures are {width} x {height}"
            raise InputError(source, prefix + key, given[key], allowed)
    distortion = np.zeros(5)
    if "distortion" in table:
        values = numbers(named, prefix + "distortion", (None,), source)
        if len(values) > 5:
            allowed = "k1, k2, p1, p2, k3, or fewer"
            raise InputError(source, prefix + "distortion", f"{len(values)} values", allowed)
        distortion[: len(values)] = values
    return Camera(width, height, **given, distortion=distortion)
