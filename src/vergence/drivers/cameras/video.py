"""A camera that OpenCV opens."""

from collections.abc import Callable

from vergence.parts import knob, part
from vergence.runtime.hardware import VideoCamera


@part("camera_source", "video")
class Video:
    """A USB camera by its number, a network stream by its address, or a video file."""

    source: int | str = 0  # device number, file path, or address of a stream
    # Delay from exposure to arrival; see `vergence calibrate --latency`.
    latency_s: float = knob(0.0, "s", least=0.0, upto=2.0)

    def open(self, name: str, clock: Callable[[], float]) -> VideoCamera:
        """Open the camera; a thread takes its images."""
        return VideoCamera(name, self.source, clock, self.latency_s)
