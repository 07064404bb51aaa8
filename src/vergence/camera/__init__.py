"""Cameras: the pinhole model with distortion, and the frames they deliver."""

from vergence.camera.frame import Frame, FrameTruth
from vergence.camera.pinhole import Camera

__all__ = ["Camera", "Frame", "FrameTruth"]
