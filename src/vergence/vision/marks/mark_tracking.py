"""Round marks as what a cell follows."""

from vergence.arrays import FloatArray, ImageArray
from vergence.parts import part
from vergence.vision.marks.mark_tracker import MarkTracker


@part("tracker", "round_marks")
class MarkTracking:
    """Follows round marks, each predicted from its last motion; see `MarkTracker`."""

    def start(self, image: ImageArray, points_px: FloatArray) -> MarkTracker:
        """Return the tracker of the marks next to places (M, 2) in the first image."""
        return MarkTracker(image, points_px)
