"""Pictures from a folder or a video."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from vergence.arrays import ImageArray
from vergence.errors import InputError

IMAGES = (".png", ".jpg", ".jpeg", ".pgm", ".ppm", ".bmp", ".tif", ".tiff", ".webp")
VIDEOS = (".avi", ".m4v", ".mkv", ".mov", ".mp4", ".mpeg", ".mpg", ".webm")
DEFAULT_RATE_HZ = 25.0


class Picture(NamedTuple):
    """One picture of the footage."""

    name: str  # its file, or the video's with a number
    time: float  # s since the first
    image: ImageArray  # (height, width) grey


@dataclass(frozen=True, slots=True)
class Footage:
    """A folder of images in order of their names, or a video."""

    path: Path
    files: tuple[Path, ...]  # empty for a video
    count: int  # pictures; 0 if a video does not tell
    rate_hz: float

    def pictures(self) -> Iterator[Picture]:
        """Yield the pictures, all of one size.

        Raises:
            InputError: if one cannot be read, is not finite, or differs in size from the first.
        """
        size = None
        for number, (name, raw) in enumerate(self._raw()):
            image = _grey(raw, name)
            size = size or image.shape
            if image.shape != size:
                given = f"{image.shape[1]} x {image.shape[0]} pixels"
                allowed = f"{size[1]} x {size[0]}, as the first picture"
                raise InputError(name, "", given, allowed)
            yield Picture(name, number / self.rate_hz, image)

    def _raw(self) -> Iterator[tuple[str, np.ndarray]]:
        import cv2

        if self.files:
            for file in self.files:
                raw = cv2.imread(str(file), cv2.IMREAD_UNCHANGED)
                if raw is None:
                    raise InputError(str(file), "", "a file that cannot be read", "an image")
                yield str(file), np.asarray(raw)
            return
        video = cv2.VideoCapture(str(self.path))
        try:
            number = 0
            while True:
                there, raw = video.read()
                if not there:
                    break
                yield f"{self.path}#{number}", np.asarray(raw)
                number += 1
        finally:
            video.release()
        if not number:
            raise InputError(str(self.path), "", "no picture that can be read", "a video")


def open_footage(path: str | Path, rate_hz: float | None = None) -> Footage:
    """Open a folder of images, or a video.

    Args:
        path: the folder or file.
        rate_hz: pictures a second; by default the video's own, or 25 for a folder.

    Raises:
        InputError: if it is not there, holds no pictures, or the rate is no rate.
    """
    where = Path(path)
    if rate_hz is not None and not (np.isfinite(rate_hz) and rate_hz > 0.0):
        raise InputError("vergence track", "--rate", rate_hz, "pictures a second, above zero")
    if where.is_dir():
        files = tuple(sorted(f for f in where.iterdir() if f.suffix.lower() in IMAGES))
        if not files:
            raise InputError(str(path), "", "a folder without images", ", ".join(IMAGES))
        return Footage(where, files, len(files), rate_hz or DEFAULT_RATE_HZ)
    if not where.is_file():
        raise InputError(str(path), "", "no such folder or file", "a folder of images or a video")
    if where.suffix.lower() not in VIDEOS:
        allowed = "a folder of images, or a video: " + ", ".join(VIDEOS)
        raise InputError(str(path), "", f"a file of kind {where.suffix or '(none)'}", allowed)
    return _open_video(where, rate_hz)


def _open_video(path: Path, rate_hz: float | None) -> Footage:
    import cv2

    video = cv2.VideoCapture(str(path))
    try:
        if not video.isOpened():
            raise InputError(str(path), "", "a file that cannot be read", "a video")
        own = float(video.get(cv2.CAP_PROP_FPS))
        count = int(video.get(cv2.CAP_PROP_FRAME_COUNT))
    finally:
        video.release()
    usable = own if np.isfinite(own) and 0.1 <= own <= 2000.0 else DEFAULT_RATE_HZ
    return Footage(path, (), max(count, 0), rate_hz or usable)


def _grey(raw: np.ndarray, name: str) -> ImageArray:
    """Return a picture as 8-bit grey; deeper ones are scaled by their type's range."""
    import cv2

    if raw.dtype.kind == "f":
        if not np.isfinite(raw).all():
            raise InputError(name, "", "values that are not finite", "a picture of numbers")
        top = 1.0 if raw.max() <= 1.0 else 255.0
        raw = np.clip(raw * (255.0 / top), 0.0, 255.0).astype(np.uint8)
    elif raw.dtype == np.uint16:
        raw = (raw >> 8).astype(np.uint8)
    elif raw.dtype != np.uint8:
        raise InputError(name, "", f"values of kind {raw.dtype}", "8 or 16 bits, or floats")
    if raw.ndim == 3:
        codes = {3: cv2.COLOR_BGR2GRAY, 4: cv2.COLOR_BGRA2GRAY}
        if raw.shape[2] not in codes:
            raise InputError(name, "", f"{raw.shape[2]} channels", "grey or colour")
        raw = np.asarray(cv2.cvtColor(raw, codes[raw.shape[2]]))
    image: ImageArray = np.ascontiguousarray(raw)
    return image
