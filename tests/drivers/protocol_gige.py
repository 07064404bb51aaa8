"""The camera source `gige`: its bridge against Aravis's own GigE Vision camera on loopback.

`make test-drivers` runs it; Aravis and PyGObject are packages of the system.
"""

import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from vergence.drivers.cameras import Gige
from vergence.drivers.cameras.gige_camera import GigeCamera
from vergence.errors import DriverSilent, InputError
from vergence.runtime.hardware import DeviceClock
from vergence.signals import Frame

SYSTEM = "/usr/bin/python3"
RATE_HZ = 25.0
BEGIN = time.monotonic()


class Camera:
    """The camera in its process."""

    def __init__(self) -> None:
        self.process = subprocess.Popen(
            [SYSTEM, str(Path(__file__).with_name("gige_fake.py"))],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
        )
        assert self.process.stdout is not None
        assert self.process.stdout.readline() == b"ready\n"

    def unplug(self) -> None:
        self.process.kill()
        self.process.communicate()


@pytest.fixture
def camera() -> Iterator[Camera]:
    made = Camera()
    yield made
    made.unplug()


def clock() -> float:
    return time.monotonic() - BEGIN


def opened(**settings: object) -> GigeCamera:
    usual = {"width": 320, "height": 240, "rate_hz": RATE_HZ, "exposure_s": 0.004}
    return Gige(**(usual | settings)).open("wrist", clock)


def taken(camera: GigeCamera, seconds: float) -> list[tuple[float, Frame]]:
    """Return the images of a while, each with the time at which it was fetched."""
    frames: list[tuple[float, Frame]] = []
    end = clock() + seconds
    while clock() < end:
        frames += [(clock(), f) for f in camera.frames(lambda t: {"arm": np.array([t])})]
        time.sleep(0.002)
    return frames


def test_images_come_at_their_rate_with_the_cameras_stamps(camera: Camera) -> None:
    source = opened()
    assert source.exposure_s == pytest.approx(0.004)
    frames = taken(source, 2.0)[10:]  # the camera sends some in quick succession at first
    source.close()
    assert len(frames) > 20
    times = np.array([frame.time for _, frame in frames])
    assert np.median(np.diff(times)) == pytest.approx(1 / RATE_HZ, rel=0.05)
    age = np.array([at - frame.time for at, frame in frames])
    assert 0.0 <= np.median(age) < 0.05
    for _, frame in frames:
        assert frame.image is not None
        assert frame.image.shape == (240, 320)
        assert frame.image.flags.owndata or frame.image.base is not None
        np.testing.assert_array_equal(frame.joints["arm"], [frame.time])


def test_times_do_not_depend_on_when_images_are_fetched(
    camera: Camera, monkeypatch: pytest.MonkeyPatch
) -> None:
    source, told = opened(), []
    check = source._told

    def noted(words: dict[str, float]) -> dict[str, float]:
        told.append((words["stamp"], words["arrived"] - BEGIN))
        return check(words)

    monkeypatch.setattr(source, "_told", noted)
    frames = [frame for _, frame in taken(source, 2.0)]
    for late_s in (*[0.15] * 8, 0.5, 1.0, 2.0):  # a loop that is late, until images are dropped
        if late_s > 0.15 and source.dropped:
            break
        time.sleep(late_s)
        frames += source.frames(lambda t: {})
    source.close()
    at_once = DeviceClock()  # of a loop that fetches every image when it arrives
    expected = [at_once.time(stamp, arrived) for stamp, arrived in told[: len(frames)]]
    np.testing.assert_allclose([frame.time for frame in frames], expected, atol=1e-4)
    ahead = time.time() - clock()  # of the camera's clock, which is the system's, before ours
    late = np.array(expected) + ahead - np.array([stamp for stamp, _ in told[: len(frames)]])
    assert np.abs(late).max() < 0.05
    assert source.dropped > 0  # only the newest image waits for a slow loop


def test_a_camera_that_is_unplugged_is_told_by_name(camera: Camera) -> None:
    source = opened()
    assert taken(source, 0.5)
    camera.unplug()
    began = clock()
    with pytest.raises(DriverSilent, match="camera wrist does not answer: check its cable"):
        taken(source, 10.0)
    assert clock() - began < 5.0
    source.close()


def test_a_bridge_that_dies_is_told(camera: Camera) -> None:
    source = opened()
    taken(source, 0.2)
    source._bridge._process.send_signal(signal.SIGKILL)
    with pytest.raises(DriverSilent, match="the bridge to camera wrist closed the connection"):
        taken(source, 2.0)
    source.close()


def test_a_second_program_finds_the_camera_in_use(camera: Camera) -> None:
    source = opened()
    with pytest.raises(InputError, match=r"driver.cameras.wrist: address: given .*"):
        opened()
    assert taken(source, 0.5)
    source.close()


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        ({"width": 4096}, r"width, height: given 4096 x 240; allowed: up to \d+ x \d+, in steps"),
        ({"address": "192.0.2.9"}, r"address: given 192.0.2.9, which does not open"),
    ],
)
def test_what_the_camera_cannot_do_is_refused(
    camera: Camera, settings: dict[str, object], said: str
) -> None:
    with pytest.raises(InputError, match=said):
        opened(**settings)


def test_without_a_camera_or_aravis_it_is_said_what_is_missing() -> None:
    with pytest.raises(InputError, match="address: missing; needed: a camera: none is found"):
        opened()
    with pytest.raises(
        InputError, match=r"python: given .* which does not run .*gir1.2-aravis-0.8"
    ):
        opened(python="/nowhere/python3")
    with pytest.raises(InputError, match=r"python: given .*cannot run the bridge .No module named"):
        opened(python=sys.executable)
