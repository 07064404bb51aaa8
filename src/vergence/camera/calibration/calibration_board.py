"""What a calibration needs of a board."""

from typing import Protocol

from vergence.arrays import ImageArray
from vergence.camera.calibration.sighting import Sighting


class CalibrationBoard(Protocol):
    """What finds its corners in an image, such as `vergence.vision.Board`."""

    def find(self, image: ImageArray, name: str) -> Sighting | None:
        """Find the board in a grey image; None where it is not seen."""
        ...

    def orientations(self, seen: Sighting) -> tuple[Sighting, ...]:
        """Return a sighting as it is, and turned in each way in which the board looks the same."""
        ...

    def seen_instead(self, image: ImageArray) -> str:
        """Return in words which other board an image shows; empty if none."""
        ...
