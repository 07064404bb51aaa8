"""Cameras: the pinhole model with distortion, files that describe it, and what it delivers."""

from vergence.camera.exposure import image_tick, image_times
from vergence.camera.files import camera_of, read_camera, write_camera
from vergence.camera.pinhole import Camera

__all__ = [
    "Camera",
    "camera_of",
    "image_tick",
    "image_times",
    "read_camera",
    "write_camera",
]
