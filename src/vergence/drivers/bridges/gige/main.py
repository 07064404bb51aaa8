"""The bridge's main program, started by the camera source."""

import os
import signal
import socket
from threading import Condition, Thread
from typing import TYPE_CHECKING, Any

from ..wire import Wire

if TYPE_CHECKING:
    from .camera import Image


class Newest:
    """Sends the newest image in a thread of its own; nothing piles up before a slow reader.

    Args:
        wire: to the source.
    """

    def __init__(self, wire: Wire) -> None:
        self._wire, self._changed = wire, Condition()
        self._image: Image | None = None
        self._skipped = 0  # images that nobody fetched in time
        Thread(target=self._send_all, daemon=True).start()

    def offer(self, image: "Image") -> None:
        """Send an image, unless a newer one comes before it can be sent."""
        with self._changed:
            self._skipped += self._image is not None
            self._image = image
            self._changed.notify()

    def _send_all(self) -> None:
        while True:
            with self._changed:
                while self._image is None:
                    self._changed.wait()
                image, self._image = self._image, None
                about = image.about | {"dropped": image.about["dropped"] + self._skipped}
            self._wire.send(about, [image.block])


def main(descriptor: int) -> None:
    """Deliver a camera's images to the other end of a socket, until that hangs up."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the run's
    wire = Wire(socket.socket(fileno=descriptor))
    settings = wire.receive()
    if settings is None:
        return
    Thread(target=_end_with, args=(wire,), daemon=True).start()
    _serve(wire, settings)
    os._exit(0)


def _serve(wire: Wire, settings: dict[str, Any]) -> None:
    """Deliver images until that cannot go on, and say why."""
    try:
        from .camera import CameraGoneError, GigeCamera, WrongSettingError
    except (ImportError, ValueError) as error:  # no PyGObject, or no Aravis behind it
        return wire.send({"cannot": str(error)})
    try:
        camera = GigeCamera(settings)
    except WrongSettingError as error:
        return wire.send({"wrong": list(error.args)})
    wire.send(camera.found)
    newest = Newest(wire)
    try:
        while True:
            if (image := camera.next_image()) is not None:
                newest.offer(image)
    except CameraGoneError as error:
        wire.send({"refused": str(error)})
        os._exit(0)  # to let go of the camera, Aravis would wait for it


def _end_with(wire: Wire) -> None:
    """End as soon as the other side has hung up."""
    while wire.receive() is not None:
        pass
    os._exit(0)
