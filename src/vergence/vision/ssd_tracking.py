"""The pyramid search of [Nelson1995] as a part in a cell file."""

from vergence.arrays import FloatArray, ImageArray
from vergence.parts import part
from vergence.vision.ssd_tracker import SsdTracker


@part("tracker", "ssd")
class SsdTracking:
    """Tracks windows of the first image by a pyramid search and an alignment; see `SsdTracker`."""

    def start(self, image: ImageArray, points_px: FloatArray) -> SsdTracker:
        """Return the tracker for points (M, 2) in the first image."""
        return SsdTracker(image, points_px)
