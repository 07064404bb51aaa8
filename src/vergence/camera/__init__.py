"""Cameras: the pinhole model with distortion, files that describe it, and what it delivers."""

from vergence.camera.exposure import picture_tick, picture_times
from vergence.camera.files import camera_of, read_camera, write_camera
from vergence.camera.pinhole import Camera

__all__ = [
    "Camera",
    "camera_of",
    "picture_tick",
    "picture_times",
    "read_camera",
    "write_camera",
]
