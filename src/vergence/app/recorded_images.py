"""Images of a run for its report: a film's frames and a few key frames, marks drawn in."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vergence.app.overlay import Marks, draw
from vergence.camera.image_file import as_jpeg
from vergence.runtime.recording import Recording

FILM_FRAMES = 160  # at most
FILM_WIDTH_PX, FILM_QUALITY = 400, 72
FILM_BYTES = 7e6  # at most, of all cameras' films on a page, where three bytes take four letters
_KEY_FRAMES = 4
KEY_FRAME_WIDTH_PX, KEY_FRAME_QUALITY = 640, 88


@dataclass(frozen=True, slots=True)
class MarkedImage:
    """One image with its marks."""

    time: float  # s, of exposure
    jpeg: bytes
    words: str = ""  # on what it shows


@dataclass(frozen=True, slots=True)
class CameraImages:
    """The images of a camera that a report shows; both empty where none was recorded."""

    film: tuple[MarkedImage, ...]  # small, evenly over the run
    key_frames: tuple[MarkedImage, ...]  # at the start, at the end, and evenly between


def camera_images(recording: Recording, camera: str) -> CameraImages:
    """Return the images of a camera that a report shows."""
    times = recording.image_times(camera).tolist()
    count = len(times)
    film = film_numbers(count)
    key = {round(number) for number in np.linspace(0, count - 1, _KEY_FRAMES)} if count else set()
    number_at = {time: number for number, time in enumerate(times)}
    traces = recording.seen_by(camera)
    frames, key_frames = [], []
    for time, image in recording.images(camera, only={*film, *key}):
        number = number_at[time]
        marks = [Marks.at(trace, time) for trace in traces]
        if number in film:
            jpeg = as_jpeg(draw(image, marks, FILM_WIDTH_PX), FILM_QUALITY)
            frames.append(MarkedImage(time, jpeg))
        if number in key:
            jpeg = as_jpeg(draw(image, marks, KEY_FRAME_WIDTH_PX), KEY_FRAME_QUALITY)
            key_frames.append(MarkedImage(time, jpeg))
    return CameraImages(thinned(frames, FILM_BYTES / len(recording.cameras)), tuple(key_frames))


def thinned(frames: Sequence[MarkedImage], most: float) -> tuple[MarkedImage, ...]:
    """Return as many of a film's frames, evenly over it, as a page has room for.

    Args:
        frames: in order of time.
        most: bytes on the page.
    """
    needed = 4 / 3 * sum(len(frame.jpeg) for frame in frames)
    return tuple(frames[:: max(1, math.ceil(needed / most))])


def film_numbers(count: int) -> range:
    """Return which of so many images a film shows."""
    return range(0, count, max(1, -(-count // FILM_FRAMES)))
