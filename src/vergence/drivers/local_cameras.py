"""The cameras of this computer beside a robot that has none."""

from collections.abc import Callable, Mapping
from dataclasses import replace

from vergence.arrays import FloatArray
from vergence.drivers.camera_source import CameraSource, OpenCamera
from vergence.signals import Frame

_EARLY_S = 0.5  # by which joints may come later than images; more is a camera's wrong clock


class LocalCameras:
    """Opens cameras and collects their images.

    An image may arrive before the joints of its exposure, which a busy robot or network holds up:
    it waits for them.

    Args:
        sources: by camera name.
        clock: the driver's time now, s.
    """

    def __init__(self, sources: Mapping[str, CameraSource], clock: Callable[[], float]) -> None:
        self._open: list[OpenCamera] = []
        self._early: list[Frame] = []  # exposed after the newest joints
        try:
            for name, source in sources.items():
                self._open.append(source.open(name, clock))
        except BaseException:
            self.close()
            raise

    def frames(
        self, joints_at: Callable[[float], Mapping[str, FloatArray]], newest: float
    ) -> tuple[Frame, ...]:
        """Return the images of all cameras that arrived since the last call, oldest first.

        Args:
            joints_at: gives the arms' joint positions, (n,) by arm name, at an exposure.
            newest: time of the newest joints, s.
        """
        waited = [replace(frame, joints=joints_at(frame.time)) for frame in self._early]
        arrived = [frame for camera in self._open for frame in camera.frames(joints_at)]
        ordered = sorted((*waited, *arrived), key=lambda frame: frame.time)
        self._early = [f for f in ordered if newest < f.time < newest + _EARLY_S]
        return tuple(f for f in ordered if not newest < f.time < newest + _EARLY_S)

    def close(self) -> None:
        """Let go of all cameras."""
        for camera in self._open:
            camera.close()
