"""Regions as what a cell follows."""

from vergence.arrays import FloatArray, ImageArray
from vergence.errors import Absent, InputError
from vergence.parts import knob, part
from vergence.vision.curves.region_tracker import HOLE_POINTS, OUTLINE_POINTS, RegionTracker
from vergence.vision.curves.rings import joined_rings, resampled, rings_of, signed_area
from vergence.vision.curves.several_curves import CurveTracker, divided, stacked, start_each


@part("tracker", "region")
class RegionTracking:
    """Follows regions that are lighter or darker than their surroundings; see `RegionTracker`."""

    # Number of regions; the points are divided evenly among them.
    count: int = knob(1, least=1, upto=16, live=False)
    holes: bool = knob(True)  # whether to track holes

    def start(self, image: ImageArray, points_px: FloatArray) -> CurveTracker:
        """Return the tracker of the regions, each around one place, or within a rough outline.

        Raises:
            InputError: if there is no region.
        """
        return start_each(
            "region", points_px, self.count, lambda points: RegionTracker(image, points, self.holes)
        )

    def points_on(self, points_px: FloatArray, size: tuple[int, int]) -> FloatArray:
        """Return the points that represent the regions, each within an outline, (M, 2).

        Raises:
            InputError: if one encloses nothing.
        """
        each = divided("region", points_px, self.count)
        return stacked("region", [_region_within(points) for points in each])


def _region_within(points_px: FloatArray) -> FloatArray:
    """Return the points that represent the region within an outline, (M, 2)."""
    rings = rings_of(points_px)
    if any(len(ring) < 3 or not abs(signed_area(ring)) > 0.0 for ring in rings):
        raise InputError(
            "region", "points", Absent("no area between them"), "corners of an outline"
        )
    counts = [OUTLINE_POINTS, *[HOLE_POINTS] * (len(rings) - 1)]
    return joined_rings([resampled(r, n) for r, n in zip(rings, counts, strict=True)])
