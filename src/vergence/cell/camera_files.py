"""The camera files that the tables of cameras name."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from vergence.errors import KeyConflict


def with_calibrations(values: dict[str, Any], path: Path) -> dict[str, Any]:
    """Put in what the camera files say that a cell names; what cannot be one is left as it is.

    Raises:
        InputError: if a file cannot be read, or the table also has keys that it sets.
    """
    cameras = values.get("cameras")
    if not isinstance(cameras, Mapping):
        return values
    calibrated = {
        name: _calibrated(table, path, f"cameras.{name}.")
        for name, table in cameras.items()
        if isinstance(table, Mapping) and isinstance(table.get("calibration"), str)
    }
    return {**values, "cameras": {**cameras, **calibrated}}


def _calibrated(table: Mapping[str, Any], path: Path, place: str) -> dict[str, Any]:
    """Return a camera's table with the lens of its camera file."""
    from vergence.camera import read_camera

    own = {key: value for key, value in table.items() if key != "calibration"}
    lens = ("resolution", "focal_mm", "pixel_um", "focal_px", "principal_px", "distortion")
    doubled = [key for key in lens if key in own]
    if doubled:
        raise KeyConflict(str(path), place + doubled[0], place + "calibration", doubled)
    camera = read_camera(path.parent / table["calibration"])
    return own | {
        "resolution": (camera.width, camera.height),
        "focal_px": (camera.fx, camera.fy),
        "principal_px": (camera.cx, camera.cy),
        "distortion": tuple(camera.distortion.tolist()),
    }
