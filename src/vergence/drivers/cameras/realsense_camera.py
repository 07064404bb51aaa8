"""A RealSense camera that is open."""

import logging
from collections.abc import Callable, Container, Iterable, Mapping, Sequence
from time import monotonic
from typing import TYPE_CHECKING, Any

import numpy as np

from vergence.arrays import FloatArray, ImageArray
from vergence.drivers.cameras.realsense_depth import RealSenseDepth, TimedImage
from vergence.errors import NOTHING, DriverSilent, InputError
from vergence.runtime.hardware import DeviceClock
from vergence.signals import Frame

if TYPE_CHECKING:
    from vergence.drivers.cameras.realsense import RealSense

_LOG = logging.getLogger(__name__)
_KEEP = 16  # images that wait to be fetched; the oldest go first
_CHECK_S = 0.5  # without an image, whether the camera is still plugged in
_GREY = {"y8": "", "rgb8": "RGB2GRAY", "bgr8": "BGR2GRAY"}  # OpenCV's conversions by format
_DEPTH = ("z16",)
_FIRST = 1  # of two infrared images, the left one


class RealSenseCamera:
    """Takes images of one stream, and tells when each was exposed.

    The camera stamps the middle of the exposure. Its clock is mapped to the run's by offset and
    drift (`DeviceClock`), so that neither USB nor a loop that is late moves the stamps.

    Args:
        rs: librealsense's package.
        device: the camera.
        name: the camera's name in the cell.
        settings: of the camera.
        clock: the run's time now, s.

    Raises:
        InputError: if the camera has no such stream.
    """

    def __init__(
        self, rs: Any, device: Any, name: str, settings: "RealSense", clock: Callable[[], float]
    ) -> None:
        self.name = name
        self._rs, self._device, self._clock = rs, device, clock
        self._latency_s, self._device_clock = settings.latency_s, DeviceClock()
        self._number, self.dropped = -1, 0  # of the last image; images that the camera skipped
        self._seen = monotonic()
        sensor, profile = find_stream(device, name, settings, settings.stream, _GREY)
        self._conversion = _GREY[profile.format().name]
        streams = [(sensor, profile)]
        self._depth: RealSenseDepth | None = None
        if settings.depth:
            streams.append(find_stream(device, name, settings, "depth", _DEPTH))
            self._depth = RealSenseDepth(profile, streams[1][1], 1.0 / settings.rate_hz)
        self._sensors = _by_sensor(rs, streams)
        self._queue = rs.frame_queue(_KEEP)
        for each, profiles in self._sensors:
            _set_options(rs, each, settings)
            each.open(profiles)
        for each, _ in self._sensors:
            each.start(self._queue)

    def frames(self, joints_at: Callable[[float], Mapping[str, FloatArray]]) -> tuple[Frame, ...]:
        """Return the images that arrived since the last call, oldest first.

        Raises:
            DriverSilent: if the camera was unplugged.
        """
        arrived: list[TimedImage] = []
        while image := self._queue.poll_for_frame():
            if self._depth is not None and self._depth.take(image):
                continue
            stamp = self._stamp(image)
            pixels = self._grey(np.asanyarray(image.get_data()))
            arrived.append(TimedImage(stamp, self._exposed(stamp), pixels))
        if arrived:
            self._seen = monotonic()
        elif monotonic() - self._seen > _CHECK_S:
            self._seen = monotonic()
            if not self._device.is_connected():
                raise DriverSilent(f"camera {self.name} was unplugged: check its cable")
        paired = (
            [(image, None) for image in arrived]
            if self._depth is None
            else self._depth.paired(arrived)
        )
        return tuple(
            Frame(self.name, image.time, image.pixels, joints_at(image.time), depth_m=depth)
            for image, depth in paired
        )

    def close(self) -> None:
        """Let go of the camera."""
        for sensor, _ in self._sensors:
            sensor.stop()
            sensor.close()
        if self.dropped:
            _LOG.info("camera %s skipped %d images", self.name, self.dropped)

    def _exposed(self, stamp: float) -> float:
        """Return the time of exposure, s of the run's clock, by the camera's stamp."""
        return self._device_clock.time(stamp, self._clock()) - self._latency_s

    def _stamp(self, image: Any) -> float:
        """Return the time of exposure, s of the camera's clock."""
        number, kind = image.get_frame_number(), self._rs.frame_metadata_value
        if self._number >= 0:
            self.dropped += max(number - self._number - 1, 0)
        self._number = number
        stamp = 1e-3 * float(image.get_timestamp())
        both = kind.sensor_timestamp, kind.frame_timestamp
        if all(map(image.supports_frame_metadata, both)):  # µs: middle of exposure, and read out
            middle, read_out = map(image.get_frame_metadata, both)
            stamp += 1e-6 * (middle - read_out)
        return stamp

    def _grey(self, pixels: np.ndarray) -> ImageArray:
        """Return a copy in grey: librealsense uses its memory again."""
        import cv2

        if not self._conversion:
            return np.array(pixels, dtype=np.uint8)
        code = getattr(cv2, f"COLOR_{self._conversion}")
        return np.asarray(cv2.cvtColor(pixels, code), dtype=np.uint8)


def find_device(rs: Any, name: str, serial: str) -> Any:
    """Return the camera of a serial number, or the only one.

    Raises:
        InputError: if there is none, or there are several and no serial number is given.
    """
    devices = {d.get_info(rs.camera_info.serial_number): d for d in rs.context().query_devices()}
    if serial in devices:
        return devices[serial]
    if not serial and len(devices) == 1:
        return next(iter(devices.values()))
    there = ", ".join(devices) or "none; check its cable, and that it is on USB 3"
    allowed = f"the serial number of a RealSense that is plugged in: {there}"
    raise InputError(f"driver.cameras.{name}", "serial", serial or NOTHING, allowed)


def find_stream(
    device: Any, name: str, settings: "RealSense", stream: str, formats: Container[str]
) -> tuple[Any, Any]:
    """Return the sensor that has a stream of the size and rate asked for, and its profile.

    Raises:
        InputError: if the camera has no such stream.
    """
    asked = settings.width, settings.height, settings.rate_hz
    there: set[tuple[int, int, int]] = set()
    for sensor, profile in _streams(device):
        video = profile.as_video_stream_profile()
        index = profile.stream_index()
        if profile.stream_type().name != stream or index not in (0, _FIRST):
            continue
        if video.format().name not in formats:
            continue
        size = video.width(), video.height(), video.fps()
        if size == asked:
            return sensor, video
        there.add(size)
    given = "{} x {} at {} Hz".format(*asked)
    allowed = ", ".join("{} x {} at {} Hz".format(*each) for each in sorted(there)[:20])
    key = f"{stream}: width, height, rate_hz"
    raise InputError(f"driver.cameras.{name}", key, given, allowed or "a camera with that stream")


def _streams(device: Any) -> Iterable[tuple[Any, Any]]:
    for sensor in device.query_sensors():
        for profile in sensor.get_stream_profiles():
            if profile.is_video_stream_profile():
                yield sensor, profile


def _by_sensor(rs: Any, streams: Sequence[tuple[Any, Any]]) -> list[tuple[Any, list[Any]]]:
    """Return each sensor with all profiles that it is to deliver: it is opened once."""
    found: dict[str, tuple[Any, list[Any]]] = {}
    for sensor, profile in streams:
        name = sensor.get_info(rs.camera_info.name)
        found.setdefault(name, (sensor, []))[1].append(profile)
    return list(found.values())


def _set_options(rs: Any, sensor: Any, settings: "RealSense") -> None:
    """Set the exposure, and switch the pattern off where it would be seen moving with the camera.

    In the colour image it is not seen, and depth is better with it.
    """
    pattern = settings.depth and settings.stream == "color"
    options = {rs.option.emitter_enabled: float(pattern)}
    if settings.exposure_s > 0.0:
        microseconds = 1e6 * settings.exposure_s
        options |= {rs.option.enable_auto_exposure: 0.0, rs.option.exposure: microseconds}
    for option, value in options.items():
        if sensor.supports(option):
            sensor.set_option(option, value)
