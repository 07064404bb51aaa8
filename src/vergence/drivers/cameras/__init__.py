"""Cameras on this computer."""

from vergence.drivers.cameras.gige import Gige
from vergence.drivers.cameras.realsense import RealSense
from vergence.drivers.cameras.video import Video

__all__ = ["Gige", "RealSense", "Video"]
