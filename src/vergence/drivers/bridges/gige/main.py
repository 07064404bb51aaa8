"""The bridge's main program, started by the camera source."""

import os
from threading import Condition, Thread
from types import ModuleType
from typing import TYPE_CHECKING, Any

from ..serve import serve
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
    serve(descriptor, _camera, _work)


def _camera() -> ModuleType:
    from . import camera

    return camera


def _work(wire: Wire, settings: dict[str, Any], library: Any) -> None:
    """Deliver images until that cannot continue, and say why."""
    Thread(target=_end_with, args=(wire,), daemon=True).start()
    try:
        camera = library.GigeCamera(settings)
    except library.WrongSettingError as error:
        return wire.send({"wrong": list(error.args)})
    wire.send(camera.found)
    newest = Newest(wire)
    try:
        while True:
            if (image := camera.next_image()) is not None:
                newest.offer(image)
    except library.CameraGoneError as error:  # to let go of the camera, Aravis would wait for it
        wire.send({"refused": str(error)})


def _end_with(wire: Wire) -> None:
    """End as soon as the other side has hung up."""
    while wire.receive() is not None:
        pass
    os._exit(0)
