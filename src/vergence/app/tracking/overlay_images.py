"""The overlay film and key frames of `vergence track` as a page shows them: fewer and smaller."""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vergence.app.recorded_images import (
    FILM_BYTES,
    FILM_QUALITY,
    FILM_WIDTH_PX,
    KEY_FRAME_QUALITY,
    KEY_FRAME_WIDTH_PX,
    CameraImages,
    MarkedImage,
    film_numbers,
    thinned,
)
from vergence.app.tracking.track_record import TrackRecord
from vergence.arrays import ImageArray
from vergence.camera.image_file import as_jpeg


def overlay_images(record: TrackRecord) -> CameraImages:
    """Return the images that a page shows; both empty where none were written."""
    film = record.answer.get("overlay")
    frames = tuple(_film(record, record.folder / Path(str(film)).name)) if film else ()
    return CameraImages(thinned(frames, FILM_BYTES), tuple(_key_frames(record)))


def _film(record: TrackRecord, path: Path) -> Iterator[MarkedImage]:
    import cv2

    count = len(record.time)
    wanted, video = film_numbers(count), cv2.VideoCapture(str(path))
    try:
        for number in range(count):
            if not video.grab():
                return
            if number in wanted:
                small = _narrowed(video.retrieve()[1], FILM_WIDTH_PX)
                yield MarkedImage(float(record.time[number]), as_jpeg(small, FILM_QUALITY))
    finally:
        video.release()


def _key_frames(record: TrackRecord) -> Iterator[MarkedImage]:
    import cv2

    for name in record.answer.get("key_frames") or ():
        path = record.folder / Path(str(name)).name
        number = re.fullmatch(r"frame-(\d+)", path.stem)
        image = cv2.imread(str(path), cv2.IMREAD_COLOR) if path.is_file() else None
        if image is None or number is None or int(number[1]) >= len(record.time):
            continue
        row = int(number[1])
        jpeg = as_jpeg(_narrowed(image, KEY_FRAME_WIDTH_PX), KEY_FRAME_QUALITY)
        yield MarkedImage(float(record.time[row]), jpeg, record.state(row))


def _narrowed(image: ImageArray | NDArray[Any], width: int) -> ImageArray:
    """Return an image that is no wider than so many pixels."""
    import cv2

    if image.shape[1] <= width:
        return np.asarray(image)
    size = (width, max(1, round(image.shape[0] * width / image.shape[1])))
    return np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_AREA))
