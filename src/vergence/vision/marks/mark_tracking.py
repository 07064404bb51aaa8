"""Round marks as a part in a cell file."""

from vergence.arrays import FloatArray, ImageArray
from vergence.parts import part
from vergence.vision.marks.mark_tracker import MarkTracker


@part("tracker", "round_marks")
class MarkTracking:
    """Tracks round marks, each predicted by its last motion; see `MarkTracker`."""

    def start(self, image: ImageArray, points_px: FloatArray) -> MarkTracker:
        """Return the tracker of the marks nearest to points (M, 2) in the first image."""
        return MarkTracker(image, points_px)
