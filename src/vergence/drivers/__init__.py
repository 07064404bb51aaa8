"""Real hardware behind the driver protocol: robots, and cameras on this computer.

A driver is a part: its settings are declared once, for `--driver` and for the table `[driver]` of a
cell file; `open` connects. None of these modules needs a robot's own package before that.
"""

from vergence.drivers.arm_driver import ArmDriver
from vergence.drivers.arm_link import ArmLink, ArmReading
from vergence.drivers.camera_source import CameraSource, OpenCamera
from vergence.drivers.equipment import Equipment
from vergence.drivers.local_cameras import LocalCameras
from vergence.optional_package import optional_package

__all__ = [
    "ArmDriver",
    "ArmLink",
    "ArmReading",
    "CameraSource",
    "Equipment",
    "LocalCameras",
    "OpenCamera",
    "optional_package",
]
