"""The part of a sensor that images show, as ROS's camera_info describes it: roi and binning."""

from collections.abc import Mapping
from typing import Any, NamedTuple

from vergence.camera.pinhole import Camera
from vergence.errors import InputError
from vergence.tables import numbers

WINDOW_KEYS = ("roi", "binning_x", "binning_y")
LARGEST_PX = 100_000  # side of an image or sensor


class SensorWindow(NamedTuple):
    """A rectangle of the sensor, and how many of its pixels are joined to one of the image."""

    x: int  # px of the sensor, as all but the binning
    y: int
    width: int  # 0: all of it
    height: int
    binning_x: int
    binning_y: int

    def camera(self, sensor: Camera, source: str) -> Camera:
        """Return the camera of the images, from that of the whole sensor.

        A pixel of the image covers b of the sensor's: u = (u_sensor - offset + 1/2) / b - 1/2.

        Raises:
            InputError: naming the source, if no pixel is left.
        """
        width = (self.width or sensor.width) // self.binning_x
        height = (self.height or sensor.height) // self.binning_y
        if not (width and height):
            given = f"{self.binning_x} x {self.binning_y}"
            raise InputError(source, "binning_x", given, "less than the image's size")
        return Camera(
            width,
            height,
            sensor.fx / self.binning_x,
            sensor.fy / self.binning_y,
            (sensor.cx - self.x + 0.5) / self.binning_x - 0.5,
            (sensor.cy - self.y + 0.5) / self.binning_y - 0.5,
            sensor.distortion,
        )


def read_window(table: Mapping[str, Any], source: str) -> SensorWindow:
    """Return the window of a table with roi, binning_x and binning_y, or with none of them.

    Raises:
        InputError: if they make no sense.
    """
    roi = table.get("roi") or {}
    if not isinstance(roi, Mapping):
        raise InputError(source, "roi", roi, "x_offset, y_offset, width and height")
    named = {f"roi.{key}": value for key, value in roi.items()}
    x, y, width, height = (
        _whole(named, f"roi.{key}", source) for key in ("x_offset", "y_offset", "width", "height")
    )
    if (width == 0) != (height == 0) or ((x or y) and not width):
        given = f"{width} x {height} at ({x}, {y})"
        raise InputError(source, "roi", given, "width and height above zero, or all zero")
    binning_x, binning_y = (max(_whole(table, key, source), 1) for key in WINDOW_KEYS[1:])
    return SensorWindow(x, y, width, height, binning_x, binning_y)


def _whole(table: Mapping[str, Any], key: str, source: str) -> int:
    value = float(numbers(table, key, (), source)) if key in table else 0.0
    if not (0 <= value <= LARGEST_PX and value == int(value)):
        raise InputError(source, key, f"{value:g}", f"a whole number from 0 to {LARGEST_PX}")
    return int(value)
