"""Files that describe a camera: our own tables, and those of ROS, OpenCV, Kalibr and ViSP."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from vergence.arrays import FloatArray
from vergence.camera.distortion import COEFFICIENTS
from vergence.camera.file_formats import own_table
from vergence.camera.pinhole import Camera
from vergence.camera.sensor_window import LARGEST_PX, WINDOW_KEYS, read_window
from vergence.errors import NOTHING, InputError
from vergence.tables import KINDS, numbers, read_tables, require_known

_KEYS = ("width", "height", "fx", "fy", "cx", "cy", "distortion")
_PINHOLE = ("fx", "fy", "cx", "cy")


def read_camera(path: Path, width: int | None = None, height: int | None = None) -> Camera:
    """Read a camera file: TOML, JSON, YAML or XML.

    Our own keys are width, height, fx, fy, cx, cy and distortion (k1, k2, p1, p2, k3). Read are
    also files and messages of ROS's camera_info, whose roi and binning change the matrix, OpenCV's
    matrices, one camera of Kalibr or EuRoC, and ViSP's XML. Further coefficients, as of the
    rational model, may be present if they are zero.

    Args:
        path: the file. Of several YAML documents all have to describe the same camera.
        width: of the images it must suit, px; the file has to say it if absent.
        height: of the images.

    Raises:
        InputError: if it cannot be read or does not suit such images.
    """
    source = str(path)
    tables = read_tables(path, "a camera", (*KINDS, ".xml"))
    cameras = [_camera(own_table(table, source), width, height, source) for table in tables]
    if any(not _same(camera, cameras[0]) for camera in cameras[1:]):
        raise InputError(source, "", f"{len(cameras)} documents that differ", "one camera")
    return cameras[0]


def _same(one: Camera, other: Camera) -> bool:
    size = (one.width, one.height) == (other.width, other.height)
    matrix = np.array_equal(one.matrix, other.matrix)
    return size and matrix and np.array_equal(one.distortion, other.distortion)


def _camera(table: Mapping[str, Any], width: int | None, height: int | None, source: str) -> Camera:
    window = read_window(table, source)
    lens = {key: value for key, value in table.items() if key not in WINDOW_KEYS}
    require_known(lens, _KEYS, source)
    shown_x = window.width or (width and width * window.binning_x)
    shown_y = window.height or (height and height * window.binning_y)
    sensor = camera_of(
        lens,
        _side(lens, "width", shown_x, window.x + window.width, source),
        _side(lens, "height", shown_y, window.y + window.height, source),
        source,
    )
    camera = window.camera(sensor, source)
    for key, have, images in (("width", camera.width, width), ("height", camera.height, height)):
        if images is not None and have != images:
            raise InputError(source, key, have, f"{images}, as the images have it")
    return camera


def camera_of(
    table: Mapping[str, Any], width: int, height: int, source: str, prefix: str = ""
) -> Camera:
    """Make a camera of a table with fx, fy, cx, cy and perhaps distortion.

    Args:
        table: the values.
        width: of the images, px.
        height: of the images.
        source: the file, for messages.
        prefix: of the keys in messages.

    Raises:
        InputError: if a value does not suit the images.
    """
    named = {prefix + key: value for key, value in table.items()}
    given = {key: float(numbers(named, prefix + key, (), source)) for key in _PINHOLE}
    for key in ("fx", "fy"):
        if not 0.1 * width <= given[key] <= 100.0 * width:
            allowed = f"a focal length in pixels; the images are {width} x {height}"
            raise InputError(source, prefix + key, given[key], allowed)
    if not 0.5 <= given["fx"] / given["fy"] <= 2.0:
        raise InputError(source, prefix + "fy", given["fy"], f"similar to fx, {given['fx']:g}")
    for key, side in (("cx", width), ("cy", height)):
        if not 0.0 <= given[key] <= side - 1:
            allowed = f"0 … {side - 1}: the images are {width} x {height}"
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


def _side(table: Mapping[str, Any], key: str, shown: int | None, least: int, source: str) -> int:
    """Return a side of the sensor, px.

    Args:
        table: may have it.
        key: width or height.
        shown: what the images show of it, if that is known.
        least: where their window ends. Some drivers write the window's size for the sensor's.
        source: for messages.
    """
    if key not in table:
        if shown is None:
            raise InputError(source, key, NOTHING, "the images' size in pixels")
        return max(shown, least)
    have = float(numbers(table, key, (), source))
    if not (1 <= have <= LARGEST_PX and have == int(have)):
        raise InputError(source, key, f"{have:g}", "a whole number of pixels")
    if have < least and have != shown:
        allowed = f"{least} or more, where roi ends, or roi's own size"
        raise InputError(source, key, f"{have:g}", allowed)
    return max(int(have), least)


def _distortion(table: Mapping[str, Any], source: str, prefix: str) -> FloatArray:
    distortion, key = np.zeros(len(COEFFICIENTS)), prefix + "distortion"
    if key not in table:
        return distortion
    values = numbers(table, key, (None,), source)
    if np.any(values[len(distortion) :]):
        allowed = (
            f"{', '.join(COEFFICIENTS)}, or fewer, with nothing but zeros behind them: k4, k5, k6 "
            "of the rational model are not supported"
        )
        raise InputError(source, key, f"{len(values)} values", allowed)
    values = values[: len(distortion)]
    distortion[: len(values)] = values
    return distortion
