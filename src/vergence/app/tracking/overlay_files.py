"""The footage with what was found drawn in: a film, and some images of it."""

from collections.abc import Mapping
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from vergence.app.tracking.film import Film
from vergence.app.tracking.footage import Footage
from vergence.app.tracking.track_subject import Subject
from vergence.arrays import ImageArray
from vergence.camera.image_file import as_jpeg

_QUALITY = 95  # JPEG
_KEY_FRAMES = 6  # spread over the footage
_MOST_KEY_FRAMES = 24  # with those where the state changes


class OverlayFiles:
    """A film of all images, and key frames: some of the images, and those where something changes.

    Args:
        folder: where to.
        footage: that they are made of.
        subject: draws itself.
        wanted: whether anything is written.
    """

    def __init__(self, folder: Path, footage: Footage, subject: Subject, wanted: bool) -> None:
        self._folder, self._subject, self._wanted = folder, subject, wanted
        self._film = Film(folder / "overlay.webm", footage.rate_hz)
        self._spacing = max(1, (footage.count or 600) // _KEY_FRAMES)
        self._key_frames: list[Path] = []
        self._state: object = None

    @property
    def files(self) -> Mapping[str, Any]:
        """The files that were written."""
        film = self._film.path if self._film.written else None
        return {"overlay": film, "key_frames": self._key_frames}

    def __enter__(self) -> Self:
        self._film.__enter__()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self._film.__exit__(kind, error, traceback)

    def add(self, number: int, image: ImageArray, last: bool) -> None:
        """Write an image of the footage, after the subject has been followed in it."""
        before, self._state = self._state, self._subject.state
        if not self._wanted:
            return
        canvas = self._subject.draw(image)
        self._film.add(canvas)
        changed = number > 0 and before != self._state
        many = len(self._key_frames) >= _MOST_KEY_FRAMES
        if (number % self._spacing == 0 or changed or last) and not many:
            path = self._folder / f"frame-{number:06d}.jpg"
            path.write_bytes(as_jpeg(canvas, _QUALITY))
            self._key_frames.append(path)
