"""What a driver for real hardware is made of: a watchdog, a clock, a camera, a memory of joints.

None of it knows a make of robot. `docs/drivers.md` shows how they go together.
"""

from vergence.runtime.hardware.device_clock import DeviceClock
from vergence.runtime.hardware.joint_history import JointHistory
from vergence.runtime.hardware.late_stamps import LateStamps
from vergence.runtime.hardware.metronome import Metronome
from vergence.runtime.hardware.video_camera import VideoCamera
from vergence.runtime.hardware.watchdog import Watchdog

__all__ = ["DeviceClock", "JointHistory", "LateStamps", "Metronome", "VideoCamera", "Watchdog"]
