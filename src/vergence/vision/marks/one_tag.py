"""Finds one marker by its number in an image, or describes what is seen instead."""

from typing import NamedTuple

import numpy as np

from vergence.arrays import FloatArray, ImageArray
from vergence.tag_families import TAG_FAMILIES
from vergence.vision.marks.coded import CodedMarks, MarkerDetector

_SMALLER = ("_50", "_100", "_250")  # dictionaries contained in the one of 1000 markers
_MOST_NAMED = 8  # largest number of markers named in a message


class OneTag(NamedTuple):
    """A marker."""

    corners_px: FloatArray  # (4, 2) clockwise from its own top left
    covariance_px: FloatArray  # (4, 2, 2) px²


def one_tag(detector: MarkerDetector, image: ImageArray, number: int) -> OneTag | str:
    """Return a marker, or why it is not found; if two have its number, neither is returned.

    Args:
        detector: of its dictionary.
        image: grey, (height, width).
        number: of the marker.
    """
    return tag_among(detector.detect(image), number)


def tag_among(seen: CodedMarks, number: int) -> OneTag | str:
    """Return one of the detected markers, or why it is not found."""
    rows = np.flatnonzero(seen.ids == number)
    if not len(rows):
        return f"marker {number} is not seen"
    if len(rows) > 1:
        return f"marker {number} is seen {len(rows)} times"
    return OneTag(seen.corners_px[rows[0]], seen.covariance_px[rows[0]])


def seen_instead(detector: MarkerDetector, image: ImageArray) -> str:
    """Return which markers an image shows, of this dictionary or another, as text.

    All dictionaries are tried, which takes a second; use it for messages only.
    """
    ids = detector.detect(image).ids.tolist()
    if ids:
        return f"it shows {_numbers(ids)} of {detector.dictionary}"
    largest = [name for name in TAG_FAMILIES if not name.endswith(_SMALLER)]
    for name in largest:
        others = MarkerDetector(name).detect(image).ids.tolist()
        if others:
            return f"it shows {_numbers(others)} of {name}"
    return "it shows no marker of any dictionary"


def _numbers(ids: list[int]) -> str:
    known = sorted(set(ids))
    more = f" and {len(known) - _MOST_NAMED} more" if len(known) > _MOST_NAMED else ""
    plural = "s" if len(known) > 1 else ""
    return f"marker{plural} {', '.join(map(str, known[:_MOST_NAMED]))}{more}"
