"""A report's film has every kept image, and its key frames span the run."""

from pathlib import Path

import cv2
import made_up_run
import numpy as np
import pytest

from vergence.app.recorded_images import CameraImages, MarkedImage, camera_images, thinned
from vergence.runtime.recording import Recording


@pytest.fixture(scope="module")
def images(recording: Recording) -> CameraImages:
    return camera_images(recording, "wrist")


def decoded(jpeg: bytes) -> object:
    return cv2.imdecode(np.frombuffer(jpeg, np.uint8), cv2.IMREAD_COLOR)


def test_a_film_has_every_kept_image_at_its_time(
    images: CameraImages, recording: Recording
) -> None:
    kept = list(recording.images("wrist"))
    assert [frame.time for frame in images.film] == [time for time, _ in kept]
    assert decoded(images.film[0].jpeg).shape == (300, 400, 3)
    texture = cv2.resize(kept[40][1], (400, 300), interpolation=cv2.INTER_LINEAR)
    drawn = decoded(images.film[40].jpeg).mean(axis=2)
    assert np.median(np.abs(drawn - texture)) < 3.0


@pytest.mark.parametrize("size", [10, 3_000, 40_000])
def test_a_film_of_large_images_has_fewer_of_them(size: int) -> None:
    frames = [MarkedImage(0.1 * k, bytes(size)) for k in range(160)]
    kept = thinned(frames, 4e5)
    assert 4 / 3 * size * len(kept) <= 4e5 + 4 / 3 * size
    assert len(kept) == 160 or 4 / 3 * size * len(kept) > 1e5
    times = [frame.time for frame in kept]
    np.testing.assert_allclose(np.diff(times), times[1], atol=1e-9)


def test_a_long_run_has_a_film_of_bounded_size(tmp_path: Path) -> None:
    long = Recording.open(made_up_run.record(tmp_path, duration=12.0, rate_hz=60.0))
    film = camera_images(long, "wrist").film
    times = [frame.time for frame in film]
    assert len(film) <= 160
    assert times[-1] > 11.8
    np.testing.assert_allclose(np.diff(times), times[1] - times[0], atol=1e-6)


def test_key_frames_span_the_run(images: CameraImages, recording: Recording) -> None:
    times = [time for time, _ in recording.images("wrist")]
    frames = images.key_frames
    assert frames[0].time == times[0]
    assert frames[-1].time == times[-1]
    assert len(frames) == 4
    assert decoded(frames[0].jpeg).shape == (480, 640, 3)


def test_a_run_without_images_has_neither(tmp_path: Path) -> None:
    bare = Recording.open(made_up_run.record(tmp_path, images=False, duration=0.5))
    assert camera_images(bare, "wrist") == CameraImages((), ())
