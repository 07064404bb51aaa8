"""A region as what a cell follows."""

from vergence.arrays import FloatArray, ImageArray
from vergence.errors import Absent, InputError
from vergence.parts import knob, part
from vergence.vision.curves.region_tracker import HOLE_POINTS, OUTLINE_POINTS, RegionTracker
from vergence.vision.curves.rings import joined_rings, resampled, rings_of, signed_area


@part("tracker", "region")
class RegionTracking:
    """Follows a region that is lighter or darker than its surroundings; see `RegionTracker`."""

    holes: bool = knob(True)  # whether to track holes

    def start(self, image: ImageArray, points_px: FloatArray) -> RegionTracker:
        """Return the tracker of the region around one place, or within a rough outline.

        Raises:
            InputError: if there is no region.
        """
        return RegionTracker(image, points_px, self.holes)

    def points_on(self, points_px: FloatArray, size: tuple[int, int]) -> FloatArray:
        """Return the points that represent the region within an outline, (M, 2).

        Raises:
            InputError: if it encloses nothing.
        """
        rings = rings_of(points_px)
        if any(len(ring) < 3 or not abs(signed_area(ring)) > 0.0 for ring in rings):
            raise InputError(
                "region", "points", Absent("no area between them"), "corners of an outline"
            )
        counts = [OUTLINE_POINTS, *[HOLE_POINTS] * (len(rings) - 1)]
        return joined_rings([resampled(r, n) for r, n in zip(rings, counts, strict=True)])
