"""The cameras of this computer beside a robot that has none."""

from collections.abc import Callable, Mapping

from vergence.arrays import FloatArray
from vergence.drivers.camera_source import CameraSource, OpenCamera
from vergence.signals import Frame


class LocalCameras:
    """Opens cameras and collects their images.

    Args:
        sources: by camera name.
        clock: the driver's time now, s.
    """

    def __init__(self, sources: Mapping[str, CameraSource], clock: Callable[[], float]) -> None:
        self._open: list[OpenCamera] = []
        try:
            for name, source in sources.items():
                self._open.append(source.open(name, clock))
        except BaseException:
            self.close()
            raise

    def frames(self, joints_at: Callable[[float], Mapping[str, FloatArray]]) -> tuple[Frame, ...]:
        """Return the images of all cameras that arrived since the last call, oldest first."""
        arrived = [frame for camera in self._open for frame in camera.frames(joints_at)]
        return tuple(sorted(arrived, key=lambda frame: frame.time))

    def close(self) -> None:
        """Let go of all cameras."""
        for camera in self._open:
            camera.close()
