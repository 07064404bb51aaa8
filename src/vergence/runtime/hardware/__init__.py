"""Building blocks of drivers for real hardware: a watchdog, a clock, a camera, a history of joints.

They do not depend on the make of the robot; see `docs/drivers.md`.
"""

from vergence.runtime.hardware.device_clock import DeviceClock
from vergence.runtime.hardware.joint_history import JointHistory
from vergence.runtime.hardware.late_stamps import LateStamps
from vergence.runtime.hardware.metronome import Metronome
from vergence.runtime.hardware.video_camera import VideoCamera
from vergence.runtime.hardware.watchdog import Watchdog

__all__ = ["DeviceClock", "JointHistory", "LateStamps", "Metronome", "VideoCamera", "Watchdog"]
