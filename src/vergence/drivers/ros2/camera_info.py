"""Whether ROS's images are of the camera that the cell describes."""

from typing import Any

import numpy as np

from vergence.camera import Camera
from vergence.camera.encodings import PIXEL_BYTES
from vergence.errors import InputError

_TOLERANCE = 0.02  # of the image's width by which two descriptions of a camera may differ
_MODEL = "plumb_bob"
_GRID = 9  # points along each side of the image that are compared


def check_image(source: str, name: str, camera: Camera, topic: str, image: Any) -> None:
    """Refuse images of another size than the cell's, or of an encoding that cannot be read.

    Args:
        source: the cell file, for messages.
        name: of the camera.
        camera: of the cell.
        topic: of the images.
        image: width, height and encoding of the first one.
    """
    width, height, encoding = image
    if encoding not in PIXEL_BYTES and encoding != "compressed":
        given = f"{topic}, whose images are {encoding}"
        allowed = f"{', '.join(PIXEL_BYTES)}, or a compressed topic"
        raise InputError(source, f"driver.images.{name}", given, allowed)
    if width and (width, height) != (camera.width, camera.height):
        _refuse_size(source, name, camera, f"{width} x {height}, the size of {topic}")


def check_info(source: str, name: str, camera: Camera, info: Any, rectified: bool) -> None:
    """Refuse a camera whose calibration in ROS is not the cell's.

    Args:
        source: the cell file, for messages.
        name: of the camera.
        camera: of the cell.
        info: size, matrix, distortion and projection.
        rectified: whether the images are without distortion.
    """
    if tuple(info["size"]) != (camera.width, camera.height):
        size = " x ".join(map(str, info["size"]))
        _refuse_size(source, name, camera, f"{size}, the size in camera_info")
    matrix = np.array(info["projection"] if rectified else info["matrix"])
    matrix = matrix.reshape(3, -1)
    if matrix[0, 0] <= 0.0 or matrix[1, 1] <= 0.0:  # an uncalibrated camera says zeros
        return
    distortion = [] if rectified else info["distortion"]
    if any(distortion) and (info["distortion_model"] != _MODEL or len(distortion) != 5):
        return
    told = Camera(
        camera.width,
        camera.height,
        *(matrix[0, 0], matrix[1, 1], matrix[0, 2], matrix[1, 2]),
        distortion if any(distortion) else np.zeros(5),
    )
    apart_px = _farthest_px(camera, told)
    if apart_px > _TOLERANCE * camera.width:
        given = f"another calibration than camera_info has, by up to {apart_px:.0f} px"
        allowed = (
            f"that of ROS: fx {told.fx:.1f}, fy {told.fy:.1f}, cx {told.cx:.1f}, cy {told.cy:.1f} "
            f"px, distortion {told.distortion.tolist()}; or correct ROS's"
        )
        raise InputError(source, f"cameras.{name}", given, allowed)


def _farthest_px(camera: Camera, other: Camera) -> float:
    """Return how far apart two cameras see the same rays at most, over the image, px."""
    u, v = np.meshgrid(
        np.linspace(0, camera.width - 1, _GRID), np.linspace(0, camera.height - 1, _GRID)
    )
    points_px = np.column_stack((u.ravel(), v.ravel()))
    apart = other.to_pixels(camera.normalize(points_px)) - points_px
    return float(np.nanmax(np.linalg.norm(apart, axis=1)))


def _refuse_size(source: str, name: str, camera: Camera, allowed: str) -> None:
    given = f"{camera.width} x {camera.height}"
    raise InputError(source, f"cameras.{name}.resolution", given, allowed)
