"""A board as one image shows it."""

from typing import NamedTuple

from vergence.arrays import FloatArray


class Sighting(NamedTuple):
    """The corners of a board found in one image."""

    name: str  # of the image
    points: FloatArray  # (n, 3) the corners in the board's frame, m
    points_px: FloatArray  # (n, 2) where they were found

    @property
    def size(self) -> int:
        """How many corners there are."""
        return len(self.points)


def pixels(size: float) -> str:
    """Return a distance in words, to two digits or whole pixels."""
    return f"{size:.0f} px" if size >= 10.0 else f"{size:.2g} px"


class BadImage(NamedTuple):
    """An image that the others contradict, or that shows no board."""

    name: str
    residual_px: float  # root mean square; NaN where no board was found
    reason: str
