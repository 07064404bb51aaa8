"""Where the images of a camera come from."""

from collections.abc import Callable, Mapping
from typing import Protocol

from vergence.arrays import FloatArray
from vergence.signals import Frame


class OpenCamera(Protocol):
    """A camera that delivers images."""

    def frames(self, joints_at: Callable[[float], Mapping[str, FloatArray]]) -> tuple[Frame, ...]:
        """Return the images that arrived since the last call, oldest first; never wait.

        Args:
            joints_at: gives the arms' joint positions, (n,) by arm name, at an exposure.
        """
        ...

    def close(self) -> None:
        """Let go of the camera."""
        ...


class CameraSource(Protocol):
    """A part that opens a camera of this computer."""

    def open(self, name: str, clock: Callable[[], float]) -> OpenCamera:
        """Open the camera.

        Args:
            name: of the camera in the cell.
            clock: the driver's time now, s; images are stamped with it.

        Raises:
            InputError: if there is no such camera.
        """
        ...
