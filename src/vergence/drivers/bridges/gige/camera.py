"""A GigE Vision camera, by Aravis."""

import socket
import struct
from time import monotonic
from typing import Any, NamedTuple

import gi

gi.require_version("Aravis", "0.8")
from gi.repository import Aravis, GLib  # noqa: E402 - after the version is chosen

_ENCODINGS = {  # by GenICam's names of pixel formats, the first that a camera has
    "Mono8": "mono8",
    "BayerRG8": "bayer_rggb8",
    "BayerGB8": "bayer_gbrg8",
    "BayerGR8": "bayer_grbg8",
    "BayerBG8": "bayer_bggr8",
    "RGB8": "rgb8",
    "BGR8": "bgr8",
}
_BUFFERS = 8
_WAIT_US = 100_000
_SILENT_S = 0.5  # without an image, whether the camera still answers
_PORT, _READ_REGISTER, _LONGEST = 3956, struct.Struct(">BBHHHI"), 600  # of GVCP
_ASKED, _ANSWER_S = 3, 0.2
_LAST_ID = 65535  # of GigE Vision's images; 1 follows


class WrongSettingError(Exception):
    """A setting that the camera does not have: key, what was given if anything, what is allowed."""


class CameraGoneError(Exception):
    """The camera does not answer any more."""


class Image(NamedTuple):
    """One image, and what is said of it."""

    about: dict[str, Any]
    block: bytes


class GigeCamera:
    """Takes images, and tells when the camera says that each was exposed.

    Args:
        settings: of the source.

    Raises:
        WrongSettingError: if there is no such camera, or it cannot do what is asked of it.
    """

    def __init__(self, settings: dict[str, Any]) -> None:
        self._name = settings["name"]
        self._camera = _opened(settings["address"])
        self._address = self._camera.get_device().get_device_address().get_address().to_string()
        try:
            encoding = self._set_up(settings)
            exposure_s = 1e-6 * float(self._camera.get_exposure_time())
        except GLib.Error as error:
            given = f"a camera that refuses to be set up ({error.message})"
            raise WrongSettingError("address", given, "another camera") from None
        self._half_s = exposure_s / 2.0
        self.found = {
            "model": self._camera.get_model_name(),
            "encoding": encoding,
            "exposure_s": exposure_s,
        }
        self._stream = self._camera.create_stream(None, None)
        if self._stream is None:
            given = "a camera that another program uses"
            raise WrongSettingError("address", given, "one that is free")
        for _ in range(_BUFFERS):
            self._stream.push_buffer(Aravis.Buffer.new_allocate(self._camera.get_payload()))
        self._last_id, self._dropped = 0, 0
        self._seen = monotonic()
        self._camera.start_acquisition()

    def next_image(self) -> Image | None:
        """Return the next image; None if none has come for a while, or a damaged one.

        Raises:
            CameraGoneError: if the camera does not answer any more.
        """
        buffer = self._stream.timeout_pop_buffer(_WAIT_US)
        if buffer is None:
            self._require_answer()
            return None
        arrived = monotonic()
        try:
            if buffer.get_status() != Aravis.BufferStatus.SUCCESS:
                return None  # its number is missing from the next one's
            self._count(buffer.get_frame_id())
            self._seen = arrived
            stamp = 1e-9 * buffer.get_timestamp() + self._half_s
            about = {"stamp": stamp, "arrived": arrived, "dropped": self._dropped}
            return Image(about, bytes(buffer.get_data()))
        finally:
            self._stream.push_buffer(buffer)

    def _set_up(self, settings: dict[str, Any]) -> str:
        """Set size, rate, exposure and format; return ROS's name of the format."""
        camera, size = self._camera, (settings["width"], settings["height"])
        most = camera.get_sensor_size()
        camera.set_region(0, 0, *(min(asked, side) for asked, side in zip(size, most, strict=True)))
        there = tuple(camera.get_region())[2:]
        if there != size:
            given, allowed = "{} x {}".format(*size), "up to {} x {}".format(*most)
            step = camera.get_width_increment(), camera.get_height_increment()
            allowed += ", in steps of {} x {}".format(*step)
            raise WrongSettingError("width, height", given, allowed)
        formats = camera.dup_available_pixel_formats_as_strings()
        chosen = next((each for each in _ENCODINGS if each in formats), None)
        if chosen is None:
            given = f"a camera of {', '.join(formats)}"
            raise WrongSettingError("address", given, f"one of {', '.join(_ENCODINGS)}")
        camera.set_pixel_format_from_string(chosen)
        if camera.is_exposure_auto_available():
            mode = Aravis.Auto.OFF if settings["exposure_s"] else Aravis.Auto.CONTINUOUS
            camera.set_exposure_time_auto(mode)
        if settings["exposure_s"]:
            camera.set_exposure_time(1e6 * settings["exposure_s"])
        self._set_rate(settings["rate_hz"])
        camera.gv_auto_packet_size()
        return _ENCODINGS[chosen]

    def _set_rate(self, rate_hz: float) -> None:
        least, most = self._camera.get_frame_rate_bounds()
        self._camera.set_frame_rate(rate_hz)
        if abs(self._camera.get_frame_rate() / rate_hz - 1.0) > 0.02:
            allowed = f"{least:.3g} … {most:.3g} Hz at this size and exposure"
            raise WrongSettingError("rate_hz", rate_hz, allowed)

    def _count(self, number: int) -> None:
        """Count the images between the last one and this."""
        if self._last_id:
            expected = self._last_id % _LAST_ID + 1
            self._dropped += min((number - expected) % _LAST_ID, 1000)
        self._last_id = number

    def _require_answer(self) -> None:
        if monotonic() - self._seen < _SILENT_S:
            return
        self._seen = monotonic()
        if not answers(self._address):
            raise CameraGoneError(f"camera {self._name} does not answer: check its cable")


def answers(address: str) -> bool:
    """Return whether a camera answers; Aravis would ask for seconds.

    Any program may read GigE Vision's register 0, the version, beside the one that has control.
    """
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as asking:
        asking.settimeout(_ANSWER_S)
        for number in range(1, _ASKED + 1):
            try:
                asking.sendto(_READ_REGISTER.pack(0x42, 1, 0x80, 4, number, 0), (address, _PORT))
                asking.recv(_LONGEST)
            except OSError:  # in time, or refused
                continue
            return True
    return False


def _opened(address: str) -> Any:
    """Return the camera of an address, a name or a serial number, or the only one."""
    Aravis.update_device_list()
    there = [Aravis.get_device_id(n) for n in range(Aravis.get_n_devices())]
    if not address and len(there) != 1:
        allowed = ", ".join(there) or "a camera: none is found; check cable, subnet and firewall"
        raise WrongSettingError("address", None, allowed)
    try:
        camera = Aravis.Camera.new(address or there[0])
    except GLib.Error as error:
        given = f"{address or there[0]}, which does not open ({error.message})"
        raise WrongSettingError("address", given, ", ".join(there) or "a camera") from None
    if not camera.is_gv_device():
        given = f"{address or there[0]}, which is no GigE Vision camera"
        raise WrongSettingError("address", given, ", ".join(there))
    return camera
