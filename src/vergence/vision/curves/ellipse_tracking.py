"""An ellipse as what a cell follows."""

from vergence.arrays import FloatArray, ImageArray
from vergence.errors import InputError
from vergence.geometry import ellipse_through
from vergence.parts import knob, part
from vergence.vision.curves.ellipse_tracker import POINTS, EllipseTracker


@part("tracker", "ellipse")
class EllipseTracking:
    """Follows the image of a circle or a sphere by its edge; see `EllipseTracker`."""

    # Largest motion of the edge between two images.
    reach_px: float = knob(20.0, "px", least=4, upto=200)
    contrast: float = knob(15.0, least=3, upto=255)  # smallest step across the edge, in grey levels
    # Smallest fraction of the ellipse that must be in view.
    least_share: float = knob(0.4, least=0.25, upto=1)

    def start(self, image: ImageArray, points_px: FloatArray) -> EllipseTracker:
        """Return the tracker of the ellipse around one place, or through five or more.

        Raises:
            InputError: if there is no ellipse.
        """
        return EllipseTracker(image, points_px, self.reach_px, self.contrast, self.least_share)

    def points_on(self, points_px: FloatArray, size: tuple[int, int]) -> FloatArray:
        """Return the points that represent the ellipse through five or more, (POINTS, 2).

        Raises:
            InputError: if no ellipse goes through them.
        """
        shape = ellipse_through(points_px)
        if shape is None:
            given = f"{len(points_px)} points on no ellipse"
            raise InputError("ellipse", "points", given, "five or more points around an ellipse")
        return shape.points(POINTS)
