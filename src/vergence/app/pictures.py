"""Pictures of a run for its report: a short film and a few key frames, marks drawn in."""

import logging
import os
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from vergence.app.overlay import Marks, draw
from vergence.arrays import ImageArray
from vergence.runtime.recording import Recording

_LOG = logging.getLogger(__name__)
_LARGEST_FILM = 240  # frames; encoding takes about 13 ms each at 640 × 480
_KEY_FRAMES = 4
_WANTED_WIDTH_PX = 640  # smaller pictures are enlarged to about this


@dataclass(frozen=True, slots=True)
class KeyFrame:
    """One picture with its marks."""

    time: float  # s, of exposure
    jpeg: bytes


def film(recording: Recording, camera: str) -> bytes | None:
    """Return the camera's pictures as a WebM film in real time; None where that is impossible."""
    kept = list(recording.images(camera))
    if len(kept) < 2:
        return None
    some = kept[:: -(-len(kept) // _LARGEST_FILM)]
    rate = (len(some) - 1) / (some[-1][0] - some[0][0])
    trace = recording.cameras[camera]
    return encode([draw(image, Marks.at(trace, time)) for time, image in some], rate)


def encode(frames: Sequence[NDArray[np.uint8]], rate_hz: float) -> bytes | None:
    """Return colour frames as a VP8 film; None if this OpenCV cannot write one."""
    import cv2

    height, width = (side - side % 2 for side in frames[0].shape[:2])  # VP8 wants them even
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "film.webm"
        code = cv2.VideoWriter.fourcc(*"VP80")
        with _silent_stderr():  # OpenCV says there that it takes WebM's own tag for VP8
            writer = cv2.VideoWriter(str(path), cv2.CAP_FFMPEG, code, rate_hz, (width, height))
        if not writer.isOpened():
            _LOG.info("this OpenCV writes no VP8: the report shows key frames only")
            return None
        for frame in frames:
            writer.write(np.ascontiguousarray(frame[:height, :width]))
        writer.release()
        return path.read_bytes()


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


def key_frames(recording: Recording, camera: str) -> list[KeyFrame]:
    """Return the pictures at the start, at the end, and evenly between."""
    kept = list(recording.images(camera))
    chosen = sorted({round(k) for k in np.linspace(0, len(kept) - 1, _KEY_FRAMES)}) if kept else []
    trace = recording.cameras[camera]
    return [
        KeyFrame(time, _jpeg(image, Marks.at(trace, time)))
        for time, image in (kept[index] for index in chosen)
    ]


def _jpeg(image: ImageArray, marks: Marks) -> bytes:
    import cv2

    scale = max(1, round(_WANTED_WIDTH_PX / image.shape[1]))
    quality = [cv2.IMWRITE_JPEG_QUALITY, 88]
    return bytes(cv2.imencode(".jpg", draw(image, marks, scale), quality)[1])
