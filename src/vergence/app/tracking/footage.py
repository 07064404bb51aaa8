"""Images from a folder, a video or a ROS 2 bag."""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import NamedTuple, TypeAlias

import numpy as np

from vergence.arrays import ImageArray
from vergence.camera.grey_levels import color_levels, grey_levels, grey_values, white_level
from vergence.camera.image_file import image_files, require_size
from vergence.camera.image_folder import leveled_images, require_like
from vergence.errors import Absent, InputError
from vergence.places import other_file
from vergence.runtime.bags import COMPRESSED, IMAGE, Bag, is_bag

VIDEOS = (".avi", ".m4v", ".mkv", ".mov", ".mp4", ".mpeg", ".mpg", ".webm")
DEFAULT_RATE_HZ = 25.0
_SLOWEST_HZ, _FASTEST_HZ = 1e-3, 1e4
_TIMED = 100  # images of a bag that tell its rate
_Stamped: TypeAlias = Iterator[tuple[str, float, np.ndarray]]  # name, s, pixels


class FootageFrame(NamedTuple):
    """One image of the footage."""

    name: str  # its file, or the video's with a number
    time: float  # s since the first
    image: ImageArray  # (height, width) grey
    color: ImageArray | None = None  # (height, width, 3) blue, green, red; None if it has none


@dataclass(frozen=True, slots=True)
class Footage:
    """A folder of images in the natural order of their names, a video, or a topic of a bag."""

    path: Path
    files: tuple[Path, ...]  # of a folder
    count: int  # images; 0 if a video does not tell
    rate_hz: float
    stamped: bool = False  # whether the images' own time stamps count, not the rate
    topic: str = ""  # of a bag

    def frames(self) -> Iterator[FootageFrame]:
        """Yield the images, all of one size; those of a folder as `leveled_images` does.

        Raises:
            InputError: if one cannot be read, is too large, or differs in size or depth from the
                first.
        """
        if self.files:
            for number, (file, grey, color) in enumerate(leveled_images(self.files)):
                yield FootageFrame(str(file), number / self.rate_hz, grey, color)
            return
        first = None
        source = _bag(self.path, self.topic) if self.topic else _video(self.path)
        for name, time, raw in _timed(source, self.rate_hz, self.stamped):
            values = grey_values(raw, name)
            first = values if first is None else first
            require_like(values, first, name)
            white = white_level(values)
            yield FootageFrame(name, time, grey_levels(values, white), color_levels(raw, white))


def open_footage(
    path: str | Path, rate_hz: float | None = None, topic: str | None = None
) -> Footage:
    """Open a folder of images, a video, or a ROS 2 bag.

    Args:
        path: the folder or file.
        rate_hz: images per second; by default the time stamps of a video or bag, or 25 for a
            folder.
        topic: of the images in a bag, where it has several.

    Raises:
        InputError: if it is not there, holds no images, or the rate is no rate.
    """
    where = Path(path)
    if topic is not None and not is_bag(where):
        raise InputError("vergence track", "--topic", topic, "only with a ROS 2 bag")
    if rate_hz is not None and not _SLOWEST_HZ <= rate_hz <= _FASTEST_HZ:
        allowed = f"from {_SLOWEST_HZ:g} to {_FASTEST_HZ:g} images per second"
        raise InputError("vergence track", "--rate", rate_hz, allowed)
    if is_bag(where):
        return _open_bag(where, rate_hz, topic)
    if where.is_dir():
        files = image_files(where)
        return Footage(where, files, len(files), rate_hz or DEFAULT_RATE_HZ)
    if not where.is_file():
        raise InputError(
            str(path), "", Absent("no such folder or file"), "a folder of images, a video or a bag"
        )
    if where.suffix.lower() not in VIDEOS:
        allowed = "a folder of images, or a video: " + ", ".join(VIDEOS)
        raise InputError(str(path), "", other_file(where), allowed)
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


def _open_bag(path: Path, rate_hz: float | None, topic: str | None) -> Footage:
    with Bag(path) as bag:
        chosen = bag.image_topic(topic)
        count = bag.topics(IMAGE, COMPRESSED)[chosen]
        times = [image.time for image in islice(bag.images(chosen), _TIMED)]
    elapsed = times[-1] - times[0] if times else 0.0
    own = (len(times) - 1) / elapsed if elapsed > 0.0 else DEFAULT_RATE_HZ
    return Footage(path, (), count, rate_hz or own, stamped=rate_hz is None, topic=chosen)


def _timed(source: _Stamped, rate_hz: float, stamped: bool) -> _Stamped:
    """Yield name, time since the first, and pixels of each image.

    A time stamp that is not later than the one before gives way to the rate.
    """
    time = start = 0.0
    for number, (name, stamp, raw) in enumerate(source):
        start = start if number else stamp
        if not stamped:
            time = number / rate_hz
        elif number:
            later = np.isfinite(stamp) and stamp - start > time
            time = stamp - start if later else time + 1.0 / rate_hz
        yield name, time, raw


def _bag(path: Path, topic: str) -> _Stamped:
    with Bag(path) as bag:
        for image in bag.images(topic):
            yield image.name, image.time, image.raw()


def _video(path: Path) -> _Stamped:
    """Yield name, time stamp and pixels of each image of a video."""
    import cv2

    video = cv2.VideoCapture(str(path))
    number = 0
    try:
        while True:
            there, raw = video.read()
            if not there:
                break
            stamp = 1e-3 * float(video.get(cv2.CAP_PROP_POS_MSEC))
            yield f"{path}#{number}", stamp, np.asarray(raw)
            number += 1
    finally:
        video.release()
    if not number:
        raise InputError(str(path), "", Absent("no image that can be read"), "a video")
