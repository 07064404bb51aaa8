"""Files that describe a camera: our own tables, OpenCV's, and ROS's camera_info."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from vergence.arrays import FloatArray
from vergence.camera.distortion import COEFFICIENTS
from vergence.camera.pinhole import Camera
from vergence.errors import InputError
from vergence.tables import numbers, read_table, require_known

_KEYS = ("width", "height", "fx", "fy", "cx", "cy", "distortion")
_PINHOLE = ("fx", "fy", "cx", "cy")
# What others call it: a file of camera_info, the message itself in ROS 1 and 2, OpenCV's samples.
_SIZES = {"width": ("image_width", "width"), "height": ("image_height", "height")}
_MATRICES = ("camera_matrix", "K", "k", "cameraMatrix")
_DISTORTIONS = ("distortion_coefficients", "D", "d", "distCoeffs", "dist_coeffs")
_MODELS = ("plumb_bob", "rational_polynomial")


def read_camera(path: Path, width: int | None = None, height: int | None = None) -> Camera:
    """Read a camera file: TOML, JSON or YAML.

    Our own keys are width, height, fx, fy, cx, cy and distortion (k1, k2, p1, p2, k3); a file of
    OpenCV or of ROS's camera_info has image_width, image_height, camera_matrix and
    distortion_coefficients, or the keys of the message. Further coefficients, as of the rational
    model, may stand there if they are zero.

    Args:
        path: the file.
        width: of the pictures it must suit, px; the file has to say it if absent.
        height: of the pictures.

    Raises:
        InputError: if it cannot be read or does not suit such pictures.
    """
    source = str(path)
    table = read_table(path, "a camera")
    if any(key in table for key in _MATRICES):
        table = _from_others(table, source)
    require_known(table, _KEYS, source)
    size = [
        _side(table, key, wanted, source) for key, wanted in (("width", width), ("height", height))
    ]
    return camera_of(table, size[0], size[1], source)


def camera_of(
    table: Mapping[str, Any], width: int, height: int, source: str, prefix: str = ""
) -> Camera:
    """Make a camera of a table with fx, fy, cx, cy and perhaps distortion.

    Args:
        table: the values.
        width: of the pictures, px.
        height: of the pictures.
        source: where it stands, for messages.
        prefix: of the keys in messages.

    Raises:
        InputError: if a value does not suit the pictures.
    """
    named = {prefix + key: value for key, value in table.items()}
    given = {key: float(numbers(named, prefix + key, (), source)) for key in _PINHOLE}
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
    camera = Camera(width, height, **given, distortion=_distortion(named, source, prefix))
    try:
        camera.undistorted()
    except InputError as error:
        raise InputError(source, prefix + "distortion", error.given, error.allowed) from None
    return camera


def write_camera(camera: Camera, path: Path, name: str = "camera") -> None:
    """Write a camera as YAML that ROS, OpenCV's users and we read: the form of camera_info."""
    c = camera

    def matrix(key: str, values: FloatArray) -> str:
        rows, columns = values.shape
        data = ", ".join(f"{value:.12g}" for value in values.ravel())
        return f"{key}:\n  rows: {rows}\n  cols: {columns}\n  data: [{data}]\n"

    path.write_text(
        f"image_width: {c.width}\nimage_height: {c.height}\ncamera_name: {name}\n"
        + matrix("camera_matrix", c.matrix)
        + "distortion_model: plumb_bob\n"
        + matrix("distortion_coefficients", c.distortion[None])
        + matrix("rectification_matrix", np.eye(3))
        + matrix("projection_matrix", np.column_stack((c.matrix, np.zeros(3))))
    )


def _side(table: Mapping[str, Any], key: str, wanted: int | None, source: str) -> int:
    if key not in table:
        if wanted is None:
            raise InputError(source, key, "nothing", "the pictures' size in pixels")
        return wanted
    have = float(numbers(table, key, (), source))
    if wanted is not None and have != wanted:
        raise InputError(source, key, f"{have:g}", f"{wanted}, as the pictures have it")
    if not (have >= 1 and have == int(have)):
        raise InputError(source, key, have, "a whole number of pixels")
    return int(have)


def _from_others(table: Mapping[str, Any], source: str) -> dict[str, Any]:
    name, values = _array(table, _MATRICES)
    flat = numbers({name: values}, name, (9,), source)
    own: dict[str, Any] = {"fx": flat[0], "fy": flat[4], "cx": flat[2], "cy": flat[5]}
    for ours, names in _SIZES.items():
        for theirs in names:
            if theirs in table:
                own[ours] = table[theirs]
    model = table.get("distortion_model") or "plumb_bob"
    if model not in _MODELS:
        raise InputError(source, "distortion_model", model, " or ".join(_MODELS))
    if any(key in table for key in _DISTORTIONS):
        name, values = _array(table, _DISTORTIONS)
        own["distortion"] = values
    return own


def _array(table: Mapping[str, Any], names: tuple[str, ...]) -> tuple[str, Any]:
    """Return which of the names is there, and its numbers in a row, matrix or not."""
    name = next(name for name in names if name in table)
    value = table[name]
    data = value.get("data", ()) if isinstance(value, Mapping) else value
    return name, np.ravel(data)


def _distortion(table: Mapping[str, Any], source: str, prefix: str) -> FloatArray:
    distortion, key = np.zeros(len(COEFFICIENTS)), prefix + "distortion"
    if key not in table:
        return distortion
    values = numbers(table, key, (None,), source)
    if np.any(values[len(distortion) :]):
        allowed = f"{', '.join(COEFFICIENTS)}, or fewer, with nothing but zeros behind them"
        raise InputError(source, key, f"{len(values)} values", allowed)
    values = values[: len(distortion)]
    distortion[: len(values)] = values
    return distortion
