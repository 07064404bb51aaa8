"""Films play, key frames show the run."""

from pathlib import Path

import cv2
import made_up_run
import numpy as np
import pytest

from vergence.app.recorded_images import encode, film, key_frames
from vergence.runtime.recording import Recording


def decoded(data: bytes, folder: Path) -> tuple[list[object], float]:
    path = folder / "film.webm"
    path.write_bytes(data)
    reader = cv2.VideoCapture(str(path))
    rate = reader.get(cv2.CAP_PROP_FPS)
    frames = []
    while (read := reader.read())[0]:
        frames.append(read[1])
    reader.release()
    return frames, rate


def test_a_film_plays_every_kept_image_in_real_time(recording: Recording, tmp_path: Path) -> None:
    data = film(recording, "wrist")
    assert data is not None
    frames, rate = decoded(data, tmp_path)
    assert len(frames) == len(list(recording.images("wrist")))
    assert rate == pytest.approx(15.0, rel=0.02)
    assert frames[0].shape == (300, 400, 3)


def test_a_film_shows_the_image_it_was_given(tmp_path: Path) -> None:
    ramp = np.add.outer(np.arange(64), np.arange(96)).astype(np.uint8)
    frame = np.repeat(ramp[..., None], 3, axis=2)
    data = encode([frame] * 5, 10.0)
    assert data is not None
    frames, _ = decoded(data, tmp_path)
    assert np.abs(frames[-1].astype(float) - frame).mean() < 4.0


def test_odd_images_lose_a_row_and_a_column(tmp_path: Path) -> None:
    data = encode([np.zeros((63, 95, 3), dtype=np.uint8)] * 3, 10.0)
    assert data is not None
    assert decoded(data, tmp_path)[0][0].shape == (62, 94, 3)


def test_encoding_says_nothing_on_the_terminal(capfd: pytest.CaptureFixture[str]) -> None:
    encode([np.zeros((64, 96, 3), dtype=np.uint8)] * 3, 10.0)
    assert capfd.readouterr().err == ""


def test_key_frames_span_the_run(recording: Recording) -> None:
    frames = key_frames(recording, "wrist")
    times = [time for time, _ in recording.images("wrist")]
    assert frames[0].time == times[0]
    assert frames[-1].time == times[-1]
    assert len(frames) == 4
    image = cv2.imdecode(np.frombuffer(frames[0].jpeg, np.uint8), cv2.IMREAD_COLOR)
    assert image.shape == (480, 640, 3)


def test_a_run_without_images_has_neither(tmp_path: Path) -> None:
    bare = Recording.open(made_up_run.record(tmp_path, images=False, duration=0.5))
    assert film(bare, "wrist") is None
    assert key_frames(bare, "wrist") == []
