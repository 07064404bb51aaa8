"""Images of a run for its report: a short film and a few key frames, marks drawn in."""

import logging
import os
import tempfile
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from vergence.app.overlay import Marks, draw
from vergence.arrays import ImageArray
from vergence.runtime.recording import Recording

if TYPE_CHECKING:
    from cv2 import VideoWriter

_LOG = logging.getLogger(__name__)
# OpenCV's VP8 takes no bit rate: what a film weighs, 17 kB and 17 ms a frame on rich texture, is
# set by its size and length.
_FILM_FRAMES = 160
_FILM_WIDTH_PX = 400
_FASTEST_HZ = 1000.0
_KEY_FRAMES = 4
_KEY_FRAME_WIDTH_PX = 640


@dataclass(frozen=True, slots=True)
class KeyFrame:
    """One image with its marks."""

    time: float  # s, of exposure
    jpeg: bytes


def film(recording: Recording, camera: str) -> bytes | None:
    """Return the camera's images as a WebM film in real time; None where that is impossible."""
    times = recording.image_times(camera)
    shown = range(0, len(times), max(1, -(-len(times) // _FILM_FRAMES)))
    if len(shown) < 2:
        return None
    length = float(times[shown[-1]] - times[0])
    if length <= 0.0:  # times that no camera has
        return None
    rate = min((len(shown) - 1) / length, _FASTEST_HZ)
    trace = recording.cameras[camera]
    frames = (
        draw(image, Marks.at(trace, time), _FILM_WIDTH_PX)
        for time, image in recording.images(camera, only=shown)
    )
    return encode(frames, rate)


def encode(frames: Iterable[NDArray[np.uint8]], rate_hz: float) -> bytes | None:
    """Return colour frames of one size as a VP8 film; None if this OpenCV cannot write one."""
    rest = iter(frames)
    first = next(rest, None)
    if first is None:
        return None
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "film.webm"
        height, width = (side - side % 2 for side in first.shape[:2])  # VP8 wants them even
        writer = _writer(path, rate_hz, (width, height))
        if not writer.isOpened():
            _LOG.info("this OpenCV writes no VP8: the report shows key frames only")
            return None
        for frame in chain([first], rest):
            writer.write(np.ascontiguousarray(frame[:height, :width]))
        writer.release()
        return path.read_bytes()


def key_frames(recording: Recording, camera: str) -> list[KeyFrame]:
    """Return the images at the start, at the end, and evenly between."""
    count = len(recording.image_times(camera))
    chosen = {round(number) for number in np.linspace(0, count - 1, _KEY_FRAMES)}
    trace = recording.cameras[camera]
    return [
        KeyFrame(time, _jpeg(image, Marks.at(trace, time)))
        for time, image in recording.images(camera, only=chosen)
    ]


def _writer(path: Path, rate_hz: float, size: tuple[int, int]) -> "VideoWriter":
    import cv2

    code = cv2.VideoWriter.fourcc(*"VP80")
    with _silent_stderr():  # OpenCV says there that it takes WebM's own tag for VP8
        return cv2.VideoWriter(str(path), cv2.CAP_FFMPEG, code, rate_hz, size)


@contextmanager
def _silent_stderr() -> Iterator[None]:
    """Keep C code's words off the terminal."""
    kept, nowhere = os.dup(2), os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 2)
    try:
        yield
    finally:
        os.dup2(kept, 2)
        os.close(kept)
        os.close(nowhere)


def _jpeg(image: ImageArray, marks: Marks) -> bytes:
    import cv2

    drawn = draw(image, marks, _KEY_FRAME_WIDTH_PX)
    return bytes(cv2.imencode(".jpg", drawn, [cv2.IMWRITE_JPEG_QUALITY, 88])[1])
