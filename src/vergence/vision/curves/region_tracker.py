"""Tracks a region of uniform grey level from image to image by its outline, including holes."""

from typing import NamedTuple

import numpy as np

from vergence.arrays import FloatArray, ImageArray
from vergence.errors import InputError
from vergence.vision.curves.curve_values import CurveValues, region_values
from vergence.vision.curves.patch import NEAR_PX, Patch, patch_at
from vergence.vision.curves.rings import inside_of, joined_rings, resampled, rings_of, signed_area
from vergence.vision.image import grey_image
from vergence.vision.tracks import Tracks, closed, nothing_found

OUTLINE_POINTS, HOLE_POINTS = 48, 16  # points that represent the outline, and each hole
_LEAST_AREA_PX = 60.0
_LEAST_HOLE = 0.01  # fraction of the region's area above which a hole counts
_CHANGE = 1.6  # largest ratio of the area between two images
_PLACE_PX = 0.2  # lower bound on the standard deviation of a point on an outline
_AGAIN_PX = 30.0  # search distance of a lost region from its last position
_WINDOW = 1.3  # first window around it, relative to the region's half size


class Region(NamedTuple):
    """A region in one image."""

    points_px: FloatArray  # (M, 2) that represent it, see `joined_rings`
    covariance_px: FloatArray  # (M, 2, 2)
    area_px: float  # without its holes
    holes: int
    light: bool  # whether it is lighter than its surroundings


class RegionTracker:
    """Tracks a region lighter or darker than all its surroundings, such as a leaf or a hole.

    Its outline is where the grey level is halfway between the means inside and outside. The result
    is represented by points evenly spaced along the outline, which form the polygon whose moments
    are those of the region; holes are cut out, see `joined_rings`.

    Args:
        image: the first image, grey.
        points_px: one point inside, or a rough outline, (M, 2).
        holes: whether holes are cut out.

    Raises:
        InputError: if there is no region.
    """

    def __init__(self, image: ImageArray, points_px: FloatArray, holes: bool = True) -> None:
        self._holes = holes
        grey, reason = grey_image(image)
        points = np.asarray(points_px, dtype=np.float64)
        place = points[0] if len(points) < 3 else inside_of(rings_of(points))
        found = reason if grey is None else self._at(grey, place, 0.0)
        if isinstance(found, str):
            raise InputError("task", "tracker", f"region, {found}", "a region at task.points_px")
        self._last, self._shift = found, np.zeros(2)

    @property
    def points_px(self) -> FloatArray:
        """The points that represent the last region found, (M, 2)."""
        return self._last.points_px.copy()

    @property
    def values(self) -> CurveValues:
        """Its area, centre and orientation, see `region_values`."""
        return region_values(self._last.points_px, self._last.covariance_px)

    def track(self, image: ImageArray, predicted_px: FloatArray | None = None) -> Tracks:
        """Find the region in a new image.

        Args:
            image: grey, (height, width).
            predicted_px: points that represent the expected region, (M, 2); None to continue as
                between the last two images.
        """
        last = self._last.points_px
        expected = last + self._shift if predicted_px is None else np.asarray(predicted_px)
        grey, reason = grey_image(image)
        found = reason if grey is None else self._follow(grey, expected)
        if isinstance(found, str):
            self._shift = np.zeros(2)
            return nothing_found(last, found, joined=closed(len(last)))
        self._shift = found.points_px.mean(axis=0) - last.mean(axis=0)
        self._last = found
        points = found.points_px
        return Tracks(
            points,
            found.covariance_px,
            np.ones(len(points), dtype=np.bool_),
            ("",) * len(points),
            joined=closed(len(points)),
        )

    def _follow(self, grey: ImageArray, expected: FloatArray) -> Region | str:
        """Return the region at its expected position, or else near its last position."""
        found = self._same(grey, expected, 0.0)
        if isinstance(found, str):
            again = self._same(grey, self._last.points_px, _AGAIN_PX)
            found = found if isinstance(again, str) else again
        return found

    def _same(self, grey: ImageArray, expected: FloatArray, away_px: float) -> Region | str:
        """Return the region near a position, or why it differs from that of the last image.

        Args:
            grey: the image.
            expected: points that represent it there, (M, 2).
            away_px: largest distance of the region from their centre.
        """
        half = _WINDOW * float(np.ptp(expected, axis=0).max()) / 2.0 + away_px
        place = inside_of(rings_of(expected))
        found = self._at(grey, place, half, self._last.light, away_px)
        if isinstance(found, str):
            return found
        change = found.area_px / self._last.area_px
        if not 1.0 / _CHANGE < change < _CHANGE:
            return f"not the same region: {change:.1f} times its area in one image"
        if found.holes != self._last.holes:
            return f"not the same region: holes: {found.holes}, before: {self._last.holes}"
        return found

    def _at(
        self,
        grey: ImageArray,
        place_px: FloatArray,
        half_px: float,
        light: bool | None = None,
        away_px: float = 0.0,
    ) -> Region | str:
        patch = patch_at(grey, place_px, half_px, light, max(away_px, NEAR_PX))
        if isinstance(patch, str):
            return patch
        if patch.cut:
            return "partly out of the image"
        area = abs(signed_area(patch.outline_px))
        if area < _LEAST_AREA_PX:
            return f"too small: {area:.0f} px, below {_LEAST_AREA_PX:.0f}"
        holes = _counted(patch, area) if self._holes else []
        rings = [resampled(patch.outline_px, OUTLINE_POINTS)]
        rings += [resampled(hole, HOLE_POINTS) for hole in holes]
        points = joined_rings(rings)
        area -= sum(abs(signed_area(hole)) for hole in holes)
        return Region(points, _covariance(grey, points), area, len(holes), patch.light)


def _counted(patch: Patch, area: float) -> list[FloatArray]:
    """Return the holes that are large enough, the largest first."""
    areas = [abs(signed_area(hole)) for hole in patch.holes_px]
    order = np.argsort(areas)[::-1]
    return [patch.holes_px[j] for j in order if areas[j] > _LEAST_HOLE * area]


def _covariance(grey: ImageArray, points: FloatArray) -> FloatArray:
    """Return the covariance of points on an outline, (M, 2, 2): noise over slope, isotropic."""
    low, high = points.min(axis=0).astype(int), points.max(axis=0).astype(int) + 2
    window = grey[max(low[1], 0) : high[1], max(low[0], 0) : high[0]].astype(np.float64)
    # A mask to which a smooth image has no response [Immerkaer1996].
    mask = np.array([1.0, -2.0, 1.0])
    rough = np.apply_along_axis(np.convolve, 0, window, mask, "valid")
    rough = np.apply_along_axis(np.convolve, 1, rough, mask, "valid")
    noise = 1.4826 * float(np.median(np.abs(rough))) / 6.0
    column, row = np.clip(np.rint(points).astype(int), 1, np.array(grey.shape[::-1]) - 2).T
    across = grey[row, column + 1].astype(np.float64) - grey[row, column - 1]
    down = grey[row + 1, column].astype(np.float64) - grey[row - 1, column]
    slope = np.maximum(0.5 * np.hypot(across, down), 1.0)
    variance = _PLACE_PX**2 + (noise / slope) ** 2
    covariance: FloatArray = variance[:, None, None] * np.eye(2)
    return covariance
