"""A film that is written as its frames come."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray


class Film:
    """A WebM film (VP8) that is written as its frames come.

    Args:
        path: of the file.
        rate_hz: frames a second.
    """

    def __init__(self, path: Path, rate_hz: float) -> None:
        self.path = path
        self.written = False
        self._rate_hz = rate_hz
        self._writer: Any = None

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        if self._writer is not None:
            self._writer.release()

    def add(self, frame: NDArray[np.uint8]) -> None:
        """Write a frame; nothing happens where this OpenCV writes no VP8."""
        height, width = (side - side % 2 for side in frame.shape[:2])  # VP8 wants them even
        if self._writer is None:
            self._writer = _open(self.path, self._rate_hz, width, height)
            self.written = self._writer.isOpened()
        if self.written:
            self._writer.write(np.ascontiguousarray(frame[:height, :width]))


def _open(path: Path, rate_hz: float, width: int, height: int) -> Any:
    import cv2

    with _silent_stderr():  # OpenCV says there that it takes WebM's own tag for VP8
        code = cv2.VideoWriter.fourcc(*"VP80")
        return cv2.VideoWriter(str(path), cv2.CAP_FFMPEG, code, rate_hz, (width, height))


@contextmanager
def _silent_stderr() -> Iterator[None]:
    """Keep C code's words off the terminal."""
    kept = os.dup(2)
    with Path(os.devnull).open("wb") as nowhere:
        os.dup2(nowhere.fileno(), 2)
        try:
            yield
        finally:
            os.dup2(kept, 2)
            os.close(kept)
