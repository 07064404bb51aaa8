"""Components for drivers of real hardware: watchdog, clock, camera, joint history.

They are independent of the robot's make; see `docs/drivers.md`.
"""

from vergence.runtime.hardware.device_clock import DeviceClock
from vergence.runtime.hardware.joint_history import JointHistory
from vergence.runtime.hardware.late_stamps import LateStamps
from vergence.runtime.hardware.metronome import Metronome
from vergence.runtime.hardware.video_camera import VideoCamera
from vergence.runtime.hardware.watchdog import Watchdog

__all__ = ["DeviceClock", "JointHistory", "LateStamps", "Metronome", "VideoCamera", "Watchdog"]
