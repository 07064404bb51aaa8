"""The dictionaries of square markers that are found, by name; light enough for a cell file."""

import re
from typing import NamedTuple

from vergence.errors import InputError, nearest


class TagFamily(NamedTuple):
    """A dictionary of markers."""

    opencv: str  # its name there
    markers: int  # how many different ones, numbered from 0


TAG_FAMILIES = {
    "apriltag_16h5": TagFamily("DICT_APRILTAG_16h5", 30),
    "apriltag_25h9": TagFamily("DICT_APRILTAG_25h9", 35),
    "apriltag_36h10": TagFamily("DICT_APRILTAG_36h10", 2320),
    "apriltag_36h11": TagFamily("DICT_APRILTAG_36h11", 587),
    **{
        f"aruco_{bits}x{bits}_{count}": TagFamily(f"DICT_{bits}X{bits}_{count}", count)
        for bits in (4, 5, 6, 7)
        for count in (50, 100, 250, 1000)
    },
    "aruco_original": TagFamily("DICT_ARUCO_ORIGINAL", 1024),
}
# Families of AprilTag 3, whose bits partly lie outside of the border or which are round: OpenCV
# does not find them.
_NOT_FOUND = ("41h12", "48h12", "49h12", "52h13", "21h7")


def tag_family(name: str, source: str, key: str = "dictionary") -> TagFamily:
    """Return a dictionary of markers by its name.

    Raises:
        InputError: if there is none of that name, or one that cannot be found in images.
    """
    if name in TAG_FAMILIES:
        return TAG_FAMILIES[name]
    bits = re.search(r"\d+h\d+", name.lower())
    if bits and bits[0] in _NOT_FOUND:
        given = f"{name}, a family of AprilTag 3 that OpenCV does not find"
        raise InputError(source, key, given, "such as apriltag_36h11: print the tag in that one")
    if bits and f"apriltag_{bits[0]}" in TAG_FAMILIES:
        raise InputError(source, key, name, f"apriltag_{bits[0]}")
    raise InputError(source, key, name, nearest(name, TAG_FAMILIES))
