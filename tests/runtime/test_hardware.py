"""The wall clock, a camera that OpenCV opens, and the memory of where the joints were."""

import time
from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np
import pytest
from scripted_cell import Notes, ScriptedDriver, ScriptedEyes, looped

from vergence.arrays import FloatArray
from vergence.errors import InputError
from vergence.runtime.hardware import (
    DeviceClock,
    JointHistory,
    Metronome,
    VideoCamera,
    metronome,
    video_camera,
)
from vergence.signals import Frame, JointState, OutcomeKind, Sample


@pytest.fixture
def video(tmp_path: Path) -> Path:
    """Twelve images at 50 Hz, each of one grey."""
    path = tmp_path / "greys.avi"
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"MJPG"), 50.0, (64, 48))
    for level in range(12):
        writer.write(np.full((48, 64, 3), 20 * level, np.uint8))
    writer.release()
    return path


def nowhere(time: float) -> dict[str, FloatArray]:
    return {"left": np.array([time])}


def all_frames(camera: VideoCamera) -> list[Frame]:
    frames: list[Frame] = []
    while not camera.ended:
        frames.extend(camera.frames(nowhere))
        time.sleep(0.005)
    frames.extend(camera.frames(nowhere))
    camera.close()
    return frames


def test_every_image_of_a_file_becomes_a_frame(video: Path) -> None:
    frames = all_frames(VideoCamera("eye", str(video), time.monotonic, latency_s=0.2, keep=100))
    assert [round(float(frame.image.mean()) / 20) for frame in frames] == list(range(12))
    assert all(frame.image.shape == (48, 64) for frame in frames)
    assert {frame.camera for frame in frames} == {"eye"}


def test_frames_carry_the_time_of_exposure_and_the_joints_then(video: Path) -> None:
    ticks = iter(0.02 * np.arange(100.0))  # the file's images are as far apart
    frames = all_frames(
        VideoCamera("eye", str(video), lambda: next(ticks), latency_s=0.25, keep=99)
    )
    exposed = 0.02 * np.arange(12) - 0.25
    np.testing.assert_allclose([frame.time for frame in frames], exposed)
    np.testing.assert_allclose([frame.joints["left"][0] for frame in frames], exposed)


def test_images_nobody_fetches_do_not_pile_up(video: Path) -> None:
    camera = VideoCamera("eye", str(video), time.monotonic, keep=3)
    while not camera.ended:
        time.sleep(0.01)
    levels = [round(float(frame.image.mean()) / 20) for frame in camera.frames(nowhere)]
    assert levels == [9, 10, 11]
    assert camera.frames(nowhere) == ()
    camera.close()


class Filmed(ScriptedDriver):
    """Its images come from a video camera, and its clock is on the wall."""

    def __init__(self, source: Path) -> None:
        super().__init__(inner_rate_hz=100.0)
        self.metronome = Metronome(self.inner_rate_hz)
        self.video = VideoCamera("eye", str(source), lambda: self.time, keep=12)

    def read(self) -> Sample:
        sample = super().read()
        return Sample(sample.time, sample.joints, self.video.frames(lambda exposed: {}))

    def step(self, setpoints) -> None:
        super().step(setpoints)
        self.metronome.wait()

    def close(self) -> None:
        self.video.close()


def test_a_camera_that_is_unplugged_ends_the_run_by_name(video: Path) -> None:
    driver, notes = Filmed(video), Notes()
    outcome = looped(driver, ScriptedEyes(), rate_hz=50.0, listeners=[notes]).run(10.0)
    driver.close()
    assert outcome.kind is OutcomeKind.IMAGE_LATE
    assert "no image for" in outcome.reason
    assert sum(len(record.sample.frames) for record in notes.ticks) == 12
    np.testing.assert_array_equal(driver.setpoints[-1]["left"].velocity, 0.0)


def test_a_camera_can_be_let_go_while_it_films(video: Path) -> None:
    camera = VideoCamera("eye", str(video), time.monotonic)
    camera.close()
    assert camera.ended


@pytest.mark.parametrize("source", ["no such file.avi", 97])
def test_a_source_that_cannot_be_opened_is_named(source: int | str) -> None:
    with pytest.raises(InputError, match=f"camera eye: given {source}"):
        VideoCamera("eye", source, time.monotonic)


def test_a_device_is_read_as_fast_as_it_delivers(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cv2, "VideoCapture", Unplugged)
    camera = VideoCamera("eye", 0, iter(range(9)).__next__, keep=9)
    assert [frame.time for frame in all_frames(camera)] == [0.0, 1.0, 2.0]


class Unplugged:
    """A device that delivers three images and is gone."""

    def __init__(self, source: int) -> None:
        self.left = 3

    def isOpened(self) -> bool:
        return True

    def get(self, what: int) -> float:
        return 0.0

    def grab(self) -> bool:
        self.left -= 1
        return self.left >= 0

    def retrieve(self):
        return True, np.zeros((48, 64), np.uint8)

    def release(self) -> None: ...


class Device:
    """A device at 50 Hz that stamps its images or not; its images wait until they are fetched.

    Its stamps run fast by 300 ppm, images take 3 to 8 ms, and for a second nobody fetches any.
    """

    def __init__(self, stamped: bool, count: int = 200) -> None:
        self.stamped, self.count, self.taken, self.now = stamped, count, 0, 0.0
        self.exposed = 0.02 * (1 + np.arange(count))
        self.arrives = self.exposed + np.random.default_rng(3).uniform(0.003, 0.008, count)

    def isOpened(self) -> bool:
        return True

    def get(self, what: int) -> float:
        if what == cv2.CAP_PROP_FPS:
            return 50.0
        return 1e3 * (1.0003 * self.exposed[self.taken - 1] + 70.0) if self.stamped else 0.0

    def grab(self) -> bool:
        if self.taken == self.count:
            return False
        waited = max(self.arrives[self.taken] - self.now, 0.0)
        self.now += waited + 1e-4
        self.taken += 1
        return True

    def retrieve(self):
        self.now += 1.0 if self.taken == 120 else 0.0
        return True, np.zeros((48, 64), np.uint8)

    def release(self) -> None: ...


@pytest.mark.parametrize("stamped", [True, False])
def test_stamps_neither_bunch_up_after_a_stall_nor_drift(stamped: bool, monkeypatch) -> None:
    device = Device(stamped)
    monkeypatch.setattr(cv2, "VideoCapture", lambda source: device)
    monkeypatch.setattr(video_camera, "monotonic", lambda: device.now)
    frames = all_frames(VideoCamera("eye", 0, lambda: device.now, latency_s=0.0055, keep=999))
    times = np.array([frame.time for frame in frames])
    assert len(times) == device.count
    assert np.abs(times - device.exposed).max() < 4e-3
    assert np.diff(times).min() > 0.75 * 0.02


def test_a_device_clock_finds_offset_and_drift_under_delays_that_vary() -> None:
    rng = np.random.default_rng(1)
    for drift in (0.0, 2e-4, -1e-3):
        clock, errors = DeviceClock(), []
        for made in np.arange(0.0, 60.0, 0.02):
            arrival = made + 0.004 + rng.exponential(0.003)
            if 20.0 < made < 21.2:
                arrival = 21.3  # a stall
            errors.append(clock.time(777.0 + (1.0 + drift) * made, arrival) - made - 0.004)
        assert min(errors[200:]) > -1e-4
        assert max(errors[200:]) < 1e-3


def test_a_device_clock_begins_anew_when_the_device_does() -> None:
    clock = DeviceClock()
    for stamp in (5.0, 6.0, 7.0):
        assert clock.time(stamp, stamp + 10.0) == pytest.approx(stamp + 10.0)
    for stamp in (0.5, 1.5, 90.0):
        assert clock.time(stamp, stamp + 30.0) == pytest.approx(stamp + 30.0)


@pytest.fixture
def wall(monkeypatch: pytest.MonkeyPatch) -> Iterator[list[float]]:
    """A clock that only moves when somebody sleeps, or the test says so."""
    now = [100.0]

    def sleep(seconds: float) -> None:
        now[0] += seconds

    monkeypatch.setattr(metronome, "monotonic", lambda: now[0])
    monkeypatch.setattr(metronome, "sleep", sleep)
    return now


def test_a_metronome_keeps_its_rate_whatever_happens_between_ticks(wall: list[float]) -> None:
    beat = Metronome(100.0)
    for used in (0.002, 0.009, 0.0, 0.004):
        wall[0] += used
        beat.wait()
    assert wall[0] == pytest.approx(100.04)


def test_a_late_tick_is_made_up_for_within_a_period(wall: list[float]) -> None:
    beat = Metronome(100.0)
    wall[0] += 0.014
    beat.wait()
    assert wall[0] == pytest.approx(100.014)
    beat.wait()
    assert wall[0] == pytest.approx(100.02)


def test_ticks_that_were_missed_are_not_rushed_through(wall: list[float]) -> None:
    beat = Metronome(100.0)
    wall[0] += 0.5
    beat.wait()
    assert beat.left_s == pytest.approx(0.01)
    beat.wait()
    assert wall[0] == pytest.approx(100.51)


def test_joints_between_two_states_lie_on_the_line_between() -> None:
    history = JointHistory()
    for t in (1.0, 2.0, 4.0):
        history.add(JointState(t, np.array([t**2, -t]), np.zeros(2)))
    np.testing.assert_allclose(history.at(1.5), [2.5, -1.5])
    np.testing.assert_allclose(history.at(3.0), [10.0, -3.0])
    np.testing.assert_allclose(history.at(2.0), [4.0, -2.0])


def test_joints_outside_of_what_is_remembered_go_on_at_their_velocity_for_a_while() -> None:
    history = JointHistory(length=2)
    for t in (1.0, 2.0, 3.0):
        history.add(JointState(t, np.array([t]), np.array([2.0])))
    assert history.at(3.05) == pytest.approx(3.1)
    assert history.at(1.95) == pytest.approx(1.9)
    assert history.at(0.0) == pytest.approx(1.8)
    assert history.at(9.0) == pytest.approx(3.2)
