"""The camera source `realsense`: librealsense's own software device in place of a camera.

`make test-drivers` runs it, in an environment that has pyrealsense2.
"""

from collections.abc import Callable

import numpy as np
import pyrealsense2 as rs
import pytest

from vergence.drivers.cameras import RealSense
from vergence.drivers.cameras.realsense_camera import RealSenseCamera, find_device
from vergence.errors import DriverSilent, InputError

WIDTH, HEIGHT, PERIOD_S = 640, 480, 1 / 30
AHEAD_S = 1000.0  # of the camera's clock before the run's
UNIT_M = 0.001  # of depth
DELAY_S = 0.02  # shortest from exposure to arrival


class Device:
    """A camera of librealsense that delivers what it is told.

    Args:
        stream: of its images.
        encoding: of those.
        depth_from: where depth is measured from, seen from the images' camera; no depth if None.
    """

    def __init__(
        self,
        stream: str = "infrared",
        encoding: str = "y8",
        depth_from: tuple[float, float, float] | None = None,
    ) -> None:
        self.device, self.connected = rs.software_device(), True
        self.sensor = self.device.add_sensor(stream)
        self.bytes = {"y8": 1, "rgb8": 3, "bgr8": 3}[encoding]
        video = rs.video_stream()
        video.type, video.fmt = getattr(rs.stream, stream), getattr(rs.format, encoding)
        video.width, video.height, video.fps, video.bpp = WIDTH, HEIGHT, 30, self.bytes
        video.index, video.uid = int(stream == "infrared"), 1
        video.intrinsics = _intrinsics()
        self.profile = self.sensor.add_video_stream(video)
        if depth_from is not None:
            self._add_depth(depth_from)

    def _add_depth(self, position: tuple[float, float, float]) -> None:
        self.depth_sensor = self.device.add_sensor("depth")
        self.depth_sensor.add_read_only_option(rs.option.depth_units, UNIT_M)
        video = rs.video_stream()
        video.type, video.fmt, video.index, video.uid = rs.stream.depth, rs.format.z16, 0, 2
        video.width, video.height, video.fps, video.bpp = WIDTH, HEIGHT, 30, 2
        video.intrinsics = _intrinsics()
        self.depth_profile = self.depth_sensor.add_video_stream(video)
        extrinsics = rs.extrinsics()
        extrinsics.rotation = [1, 0, 0, 0, 1, 0, 0, 0, 1]
        extrinsics.translation = list(position)
        self.depth_profile.register_extrinsics_to(self.profile, extrinsics)

    def deliver_depth(self, number: int, depth_m: np.ndarray) -> None:
        frame = rs.software_video_frame()
        frame.pixels = np.ascontiguousarray(np.rint(depth_m / UNIT_M), np.uint16)
        frame.stride, frame.bpp, frame.depth_units = 2 * WIDTH, 2, UNIT_M
        frame.timestamp = 1e3 * (AHEAD_S + number * PERIOD_S + 0.002)
        frame.frame_number, frame.domain = number, rs.timestamp_domain.hardware_clock
        frame.profile = self.depth_profile.as_video_stream_profile()
        self.depth_sensor.on_video_frame(frame)

    def query_sensors(self) -> list[object]:
        return self.device.query_sensors()

    def is_connected(self) -> bool:
        return self.connected

    def deliver(self, number: int, pixels: np.ndarray) -> None:
        frame = rs.software_video_frame()
        frame.pixels = np.ascontiguousarray(pixels)
        frame.stride, frame.bpp = WIDTH * self.bytes, self.bytes
        frame.timestamp = 1e3 * (AHEAD_S + number * PERIOD_S)
        frame.frame_number, frame.domain = number, rs.timestamp_domain.hardware_clock
        frame.profile = self.profile.as_video_stream_profile()
        self.sensor.on_video_frame(frame)


def _intrinsics() -> "rs.intrinsics":
    told = rs.intrinsics()
    told.width, told.height, told.fx, told.fy = WIDTH, HEIGHT, 600.0, 600.0
    told.ppx, told.ppy, told.model = 319.5, 239.5, rs.distortion.none
    return told


def open_camera(device: Device, clock: Callable[[], float], **settings: object) -> RealSenseCamera:
    return RealSenseCamera(rs, device, "wrist", RealSense(**settings), clock)


def joints(time: float) -> dict[str, np.ndarray]:
    return {"arm": np.array([time])}


def test_images_have_the_times_of_their_exposure_however_late_they_are_fetched() -> None:
    device, now = Device(), [0.0]
    camera = open_camera(device, lambda: now[0], latency_s=DELAY_S)
    late_s = np.random.default_rng(1).uniform(0.0, 0.03, 60)
    late_s[::4] = 0.0
    errors = []
    for number in range(60):
        device.deliver(number, np.full((HEIGHT, WIDTH), number, np.uint8))
        now[0] = number * PERIOD_S + DELAY_S + late_s[number]
        (frame,) = camera.frames(joints)
        assert frame.image is not None
        assert (frame.image == number).all()
        np.testing.assert_array_equal(frame.joints["arm"], [frame.time])
        errors.append(frame.time - number * PERIOD_S)
    camera.close()
    assert np.abs(errors).max() < 1e-6


@pytest.mark.parametrize("encoding", ["rgb8", "bgr8"])
def test_colour_becomes_grey(encoding: str) -> None:
    device = Device("color", encoding)
    camera = open_camera(device, lambda: 0.0, stream="color")
    pixels = np.zeros((HEIGHT, WIDTH, 3), np.uint8)
    pixels[:, :, encoding.index("r")] = 255
    device.deliver(0, pixels)
    (frame,) = camera.frames(joints)
    camera.close()
    assert frame.image is not None
    assert frame.image.shape == (HEIGHT, WIDTH)
    assert (frame.image == 76).all()


@pytest.mark.parametrize(("stream", "encoding"), [("infrared", "y8"), ("color", "rgb8")])
def test_depth_lies_beside_its_image_and_in_its_place(stream: str, encoding: str) -> None:
    beside = (0.0, 0.0, 0.0) if stream == "infrared" else (0.05, 0.0, 0.0)
    device = Device(stream, encoding, depth_from=beside)
    camera = open_camera(device, lambda: 0.0, stream=stream, depth=True)
    depth = np.full((HEIGHT, WIDTH), 1.0)
    depth[:, :100] = 0.0  # unknown
    shape = (HEIGHT, WIDTH) if encoding == "y8" else (HEIGHT, WIDTH, 3)
    frames = []
    for number in range(4):
        device.deliver(number, np.full(shape, number, np.uint8))
        if number == 1:
            frames += camera.frames(joints)  # its depth comes later
        if number != 2:  # and that of this one never
            device.deliver_depth(number, depth * (1 + number))
        frames += camera.frames(joints)
    camera.close()
    assert [int(frame.image[0, 0]) for frame in frames if frame.image is not None] == [0, 1, 2, 3]
    assert frames[2].depth_m is None
    shift = round(600.0 * beside[0])  # f t / z px
    for number in (0, 1, 3):
        measured = frames[number].depth_m
        assert measured is not None
        known = measured[240, 100 + shift + 5 :]
        np.testing.assert_allclose(known, 1.0 + number, rtol=1e-6)
        assert not (measured[240, : 100 + shift // (1 + number) - 3] > 0.0).any()


def test_a_camera_without_depth_is_refused() -> None:
    with pytest.raises(InputError, match=r"depth: width, .*; allowed: a camera with that stream"):
        open_camera(Device(), lambda: 0.0, depth=True)


def test_images_keep_no_memory_of_the_camera_which_has_little() -> None:
    device = Device()
    camera = open_camera(device, lambda: 0.0)
    device.deliver(0, np.zeros((HEIGHT, WIDTH), np.uint8))
    (frame,) = camera.frames(joints)
    camera.close()
    owner = frame.image
    while getattr(owner, "base", None) is not None:
        owner = owner.base
    assert isinstance(owner, np.ndarray)


def test_images_that_were_skipped_are_counted() -> None:
    device = Device()
    camera = open_camera(device, lambda: 0.0)
    for number in (3, 4, 7, 9):
        device.deliver(number, np.zeros((HEIGHT, WIDTH), np.uint8))
        camera.frames(joints)
    camera.close()
    assert camera.dropped == 3


def test_a_camera_that_is_unplugged_is_told_by_name(monkeypatch: pytest.MonkeyPatch) -> None:
    from vergence.drivers.cameras import realsense_camera

    now = [0.0]
    monkeypatch.setattr(realsense_camera, "monotonic", lambda: now[0])
    device = Device()
    camera = open_camera(device, lambda: 0.0)
    now[0] = 0.6
    assert camera.frames(joints) == ()
    device.connected = False
    now[0] = 1.2
    with pytest.raises(DriverSilent, match="camera wrist was unplugged"):
        camera.frames(joints)
    camera.close()


def test_a_camera_or_stream_that_is_not_there_is_refused() -> None:
    with pytest.raises(InputError, match=r"wrist: serial: given 123; allowed: .*plugged in: none"):
        find_device(rs, "wrist", "123")
    with pytest.raises(InputError, match=r"driver.cameras.wrist: serial: missing"):
        RealSense().open("wrist", lambda: 0.0)
    with pytest.raises(InputError, match=r"given 848 x 480 at 30 Hz; allowed: 640 x 480 at 30 Hz"):
        open_camera(Device(), lambda: 0.0, width=848)
    with pytest.raises(InputError, match=r"color: width, .*; allowed: a camera with that stream"):
        open_camera(Device(), lambda: 0.0, stream="color")
