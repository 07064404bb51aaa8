"""The settings of a GigE Vision camera."""

from collections.abc import Callable

from vergence.drivers.cameras.gige_camera import GigeCamera
from vergence.parts import knob, part


@part("camera_source", "gige")
class Gige:
    """A GigE Vision camera, through Aravis, at the camera's own time stamps."""

    address: str = ""  # IP address, Aravis name or serial number; the only camera if empty
    width: int = knob(640, "px", least=1)  # image width; must match the cell's resolution
    height: int = knob(480, "px", least=1)  # image height; must match the cell's resolution
    rate_hz: float = knob(30.0, "Hz", above=0.0, upto=1000.0)  # image rate
    exposure_s: float = knob(0.0, "s", least=0.0, upto=1.0)  # exposure time; automatic if 0
    # Shortest delay from exposure to arrival; see `vergence calibrate --latency`.
    latency_s: float = knob(0.0, "s", least=0.0, upto=2.0)
    python: str = "/usr/bin/python3"  # Python interpreter that has Aravis

    def open(self, name: str, clock: Callable[[], float]) -> GigeCamera:
        """Start the bridge and the camera."""
        return GigeCamera(name, self, clock)
