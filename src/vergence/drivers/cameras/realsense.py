"""The settings of a RealSense camera."""

from collections.abc import Callable
from typing import Literal

from vergence.drivers.cameras.realsense_camera import RealSenseCamera, find_device
from vergence.optional_package import optional_package
from vergence.parts import knob, part


@part("camera_source", "realsense")
class RealSense:
    """The colour or left infrared image of a RealSense, and its depth, at its own time stamps."""

    serial: str = ""  # serial number of the camera; the only connected one if empty
    stream: Literal["infrared", "color"] = "infrared"  # image stream; infrared has a global shutter
    width: int = knob(640, "px", least=1)  # image width; must match the cell's resolution
    height: int = knob(480, "px", least=1)  # image height; must match the cell's resolution
    rate_hz: int = knob(30, "Hz", least=1)  # a rate that the camera supports at that size
    depth: bool = False  # also measure depth; the cell's camera then needs a table `depth`
    exposure_s: float = knob(0.0, "s", least=0.0, upto=1.0)  # exposure time; automatic if 0
    # Shortest delay from exposure to arrival; see `vergence calibrate --latency`.
    latency_s: float = knob(0.0, "s", least=0.0, upto=2.0)

    def open(self, name: str, clock: Callable[[], float]) -> RealSenseCamera:
        """Open the camera; librealsense takes its images in threads of its own."""
        rs = optional_package("realsense", "pyrealsense2", "realsense", f"driver.cameras.{name}")
        return RealSenseCamera(rs, find_device(rs, name, self.serial), name, self, clock)
