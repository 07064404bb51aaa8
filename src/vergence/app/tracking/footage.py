"""Images from a folder or a video."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from vergence.arrays import ImageArray
from vergence.camera.grey_levels import grey_levels, grey_values, white_level
from vergence.camera.image_file import image_files, require_size
from vergence.camera.image_folder import grey_images, require_like
from vergence.errors import InputError

VIDEOS = (".avi", ".m4v", ".mkv", ".mov", ".mp4", ".mpeg", ".mpg", ".webm")
DEFAULT_RATE_HZ = 25.0


class FootageFrame(NamedTuple):
    """One image of the footage."""

    name: str  # its file, or the video's with a number
    time: float  # s since the first
    image: ImageArray  # (height, width) grey


@dataclass(frozen=True, slots=True)
class Footage:
    """A folder of images in the natural order of their names, or a video."""

    path: Path
    files: tuple[Path, ...]  # empty for a video
    count: int  # images; 0 if a video does not tell
    rate_hz: float
    stamped: bool = False  # whether a video's own time stamps count, not the rate

    def frames(self) -> Iterator[FootageFrame]:
        """Yield the images, all of one size; those of a folder as `grey_images` does.

        Raises:
            InputError: if one cannot be read, is too large, or differs in size or depth from the
                first.
        """
        if self.files:
            for number, (file, image) in enumerate(grey_images(self.files)):
                yield FootageFrame(str(file), number / self.rate_hz, image)
            return
        first = None
        for name, time, raw in _video(self.path, self.rate_hz, self.stamped):
            values = grey_values(raw, name)
            first = values if first is None else first
            require_like(values, first, name)
            yield FootageFrame(name, time, grey_levels(values, white_level(values)))


def open_footage(path: str | Path, rate_hz: float | None = None) -> Footage:
    """Open a folder of images, or a video.

    Args:
        path: the folder or file.
        rate_hz: images per second; by default a video's own time stamps, or 25 for a folder.

    Raises:
        InputError: if it is not there, holds no images, or the rate is no rate.
    """
    where = Path(path)
    if rate_hz is not None and not (np.isfinite(rate_hz) and rate_hz > 0.0):
        raise InputError("vergence track", "--rate", rate_hz, "images a second, above zero")
    if where.is_dir():
        files = image_files(where)
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
        width, height = (
            int(video.get(side)) for side in (cv2.CAP_PROP_FRAME_WIDTH, cv2.CAP_PROP_FRAME_HEIGHT)
        )
    finally:
        video.release()
    require_size(width, height, str(path))
    usable = own if np.isfinite(own) and 0.1 <= own <= 2000.0 else DEFAULT_RATE_HZ
    return Footage(path, (), max(count, 0), rate_hz or usable, stamped=rate_hz is None)


def _video(path: Path, rate_hz: float, stamped: bool) -> Iterator[tuple[str, float, np.ndarray]]:
    """Yield name, time and pixels of each image of a video.

    A time stamp that is not later than the one before gives way to the rate.
    """
    import cv2

    video = cv2.VideoCapture(str(path))
    number, time, start = 0, 0.0, 0.0
    try:
        while True:
            there, raw = video.read()
            if not there:
                break
            stamp = 1e-3 * float(video.get(cv2.CAP_PROP_POS_MSEC))
            start = start if number else stamp
            if not stamped:
                time = number / rate_hz
            elif number:
                later = np.isfinite(stamp) and stamp - start > time
                time = stamp - start if later else time + 1.0 / rate_hz
            yield f"{path}#{number}", time, np.asarray(raw)
            number += 1
    finally:
        video.release()
    if not number:
        raise InputError(str(path), "", "no image that can be read", "a video")
