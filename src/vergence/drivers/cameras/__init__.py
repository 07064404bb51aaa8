"""Cameras on this computer."""

from vergence.drivers.cameras.video import Video

__all__ = ["Video"]
