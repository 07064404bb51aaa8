"""Ellipses as what a cell follows."""

import numpy as np

from vergence.arrays import FloatArray, ImageArray
from vergence.errors import InputError
from vergence.geometry import ellipse_through
from vergence.parts import knob, part
from vergence.vision.curves.ellipse_tracker import POINTS, EllipseTracker
from vergence.vision.curves.several_curves import CurveTracker, divided, start_each


@part("tracker", "ellipse")
class EllipseTracking:
    """Follows images of circles or spheres by their edges; see `EllipseTracker`."""

    # Number of ellipses; the points are divided evenly among them.
    count: int = knob(1, least=1, upto=16, live=False)
    # Largest motion of the edge between two images.
    reach_px: float = knob(20.0, "px", least=4, upto=200)
    contrast: float = knob(15.0, least=3, upto=255)  # smallest step across the edge, in grey levels
    # Smallest fraction of the ellipse that must be in view.
    least_share: float = knob(0.4, least=0.25, upto=1)

    def start(self, image: ImageArray, points_px: FloatArray) -> CurveTracker:
        """Return the tracker of the ellipses, each around one place, or through five or more.

        Raises:
            InputError: if there is no ellipse.
        """
        knobs = self.reach_px, self.contrast, self.least_share
        return start_each(
            "ellipse", points_px, self.count, lambda points: EllipseTracker(image, points, *knobs)
        )

    def points_on(self, points_px: FloatArray, size: tuple[int, int]) -> FloatArray:
        """Return the points that represent ellipses through five or more each, (M, 2).

        Raises:
            InputError: if no ellipse passes through them.
        """
        each = divided("ellipse", points_px, self.count)
        return np.concatenate([_ellipse_on(points) for points in each])


def _ellipse_on(points_px: FloatArray) -> FloatArray:
    """Return the points that represent the ellipse through five or more, (POINTS, 2)."""
    shape = ellipse_through(points_px)
    if shape is None:
        given = f"{len(points_px)} points on no ellipse"
        raise InputError("ellipse", "points", given, "five or more points around an ellipse")
    return shape.points(POINTS)
