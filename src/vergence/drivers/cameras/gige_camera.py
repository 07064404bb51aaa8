"""A GigE Vision camera that is open, in a process of its own."""

import logging
from collections.abc import Callable, Mapping
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING, Any

import numpy as np

from vergence.arrays import FloatArray
from vergence.camera.encodings import grey_image
from vergence.drivers import bridges
from vergence.drivers.bridge_process import BridgeProcess, BridgeProgram
from vergence.drivers.socket_robot import LinkBrokenError, decode
from vergence.errors import NOTHING, DriverSilent, InputError
from vergence.runtime.hardware import DeviceClock
from vergence.signals import Frame

if TYPE_CHECKING:
    from vergence.drivers.cameras.gige import Gige

_LOG = logging.getLogger(__name__)
_CONNECT_S = 10.0  # for the camera to be found and opened
_INSTALL = (
    "a Python that has Aravis: /usr/bin/python3 after `apt-get install gir1.2-aravis-0.8 "
    "python3-gi` (Debian, Ubuntu)"
)


class GigeCamera:
    """Takes images from the bridge, and tells when each was exposed.

    The camera's stamps, moved to the middle of the exposure, are mapped to the run's clock by
    offset and drift (`DeviceClock`).

    Args:
        name: the camera's name in the cell.
        settings: of the camera.
        clock: the run's time now, s.

    Raises:
        InputError: if Aravis is not installed, or there is no such camera.
    """

    def __init__(self, name: str, settings: "Gige", clock: Callable[[], float]) -> None:
        self.name, self._clock = name, clock
        self._size = settings.width, settings.height
        self._latency_s, self._device_clock = settings.latency_s, DeviceClock()
        self.dropped = 0  # images that were lost on the way
        self._about: dict[str, Any] | None = None  # of the image whose pixels are still to come
        source = f"driver.cameras.{name}"
        asked = {
            "name": name,
            "address": settings.address,
            "width": settings.width,
            "height": settings.height,
            "rate_hz": settings.rate_hz,
            "exposure_s": settings.exposure_s,
        }
        program = BridgeProgram(Path(bridges.__file__).parent, "gige", "Aravis", _INSTALL)
        self._bridge = BridgeProcess(
            program, settings.python, (source, "python"), asked, _CONNECT_S
        )
        found = self._bridge.found
        if "wrong" in found:
            self._bridge.close()
            key, given, allowed = found["wrong"]
            raise InputError(source, key, NOTHING if given is None else given, allowed)
        self._encoding, self.exposure_s = str(found["encoding"]), float(found["exposure_s"])

    def frames(self, joints_at: Callable[[float], Mapping[str, FloatArray]]) -> tuple[Frame, ...]:
        """Return the images that arrived since the last call, oldest first.

        Raises:
            DriverSilent: if the camera was unplugged, or the bridge has ended.
        """
        arrived = []
        try:
            while (message := self._bridge.link.receive(0.0)) is not None:
                if self._about is None:
                    self._about = self._told(decode(message))
                    continue
                about, self._about = self._about, None
                arrived.append(self._frame(about, message, joints_at))
        except LinkBrokenError as error:
            raise DriverSilent(f"the bridge to camera {self.name} {error}") from error
        return tuple(arrived)

    def close(self) -> None:
        """Let go of the camera."""
        self._bridge.close()
        if self.dropped:
            _LOG.info("camera %s lost %d images", self.name, self.dropped)

    def _told(self, words: dict[str, Any]) -> dict[str, Any]:
        if "refused" in words:
            raise DriverSilent(str(words["refused"]))
        if not {"stamp", "arrived", "dropped"} <= words.keys():
            raise LinkBrokenError("sends something other than images")
        return words

    def _frame(
        self,
        about: Mapping[str, Any],
        block: bytes,
        joints_at: Callable[[float], Mapping[str, FloatArray]],
    ) -> Frame:
        self.dropped = int(about["dropped"])
        # One monotonic clock for all processes of a computer. It is read first: an interruption
        # between the two makes the arrival late, which the device's clock ignores.
        waited_s = max(monotonic() - float(about["arrived"]), 0.0)
        arrival = self._clock() - waited_s
        time = self._device_clock.time(float(about["stamp"]), arrival) - self._latency_s
        image = grey_image(block, self._encoding, *self._size)
        if image is None:
            raise LinkBrokenError("sends an image of another size")
        return Frame(self.name, time, np.array(image), joints_at(time))
