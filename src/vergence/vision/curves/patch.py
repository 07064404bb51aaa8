"""The patch of uniform grey level around a point, and its outline to a fraction of a pixel."""

from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from vergence.arrays import FloatArray, ImageArray

_FIRST_HALF_PX = 24.0
_LEAST_CONTRAST = 20.0  # grey values between the patch and its surroundings
NEAR_PX = 3.0  # of a point beside the patch


class Patch(NamedTuple):
    """A patch lighter or darker than its surroundings."""

    outline_px: FloatArray  # (K, 2) closed, its last point beside its first
    holes_px: tuple[FloatArray, ...]  # the outlines of its holes
    light: bool  # whether it is lighter
    contrast: float  # grey values
    cut: bool  # whether it is cut by the border of the image


def patch_at(
    image: ImageArray,
    place_px: FloatArray,
    half_px: float = 0.0,
    light: bool | None = None,
    near_px: float = NEAR_PX,
) -> Patch | str:
    """Return the patch that contains a point, or the nearest one, or why there is none.

    The grey levels of a window are separated by Otsu's threshold, halfway between the means of both
    sides; the window grows until its border does not cut the patch.

    Args:
        image: grey, (height, width).
        place_px: the point, (2,).
        half_px: half the size of the first window.
        light: whether the patch is lighter than its surroundings; if None, as the point is. If
            given, the point may lie in a hole of the patch.
        near_px: largest distance of the point from the patch.
    """
    height, width = image.shape
    u, v = place_px
    if not (0.0 <= u <= width - 1.0 and 0.0 <= v <= height - 1.0):
        return "outside the image"
    half = max(half_px, _FIRST_HALF_PX)
    while True:
        left, right = max(int(u - half), 0), min(int(u + half) + 1, width)
        top, bottom = max(int(v - half), 0), min(int(v + half) + 1, height)
        whole = right - left == width and bottom - top == height
        found = _in_window(image[top:bottom, left:right], place_px - (left, top), light, near_px)
        if isinstance(found, str):
            if whole:
                return found
        else:
            low, high = found.outline_px.min(axis=0), found.outline_px.max(axis=0)
            ends = np.array([right - left, bottom - top]) - 1.0
            cut = np.concatenate((low <= 0.0, high >= ends))
            at_border = np.array([left == 0, top == 0, right == width, bottom == height])
            if whole or not (cut & ~at_border).any():
                corner = np.array([left, top], dtype=np.float64)
                holes = tuple(hole + corner for hole in found.holes_px)
                outline = found.outline_px + corner
                return Patch(outline, holes, found.light, found.contrast, bool(cut.any()))
        half *= 2.0


def _in_window(
    window: ImageArray, place: FloatArray, light: bool | None, near_px: float
) -> Patch | str:
    import cv2
    from contourpy import FillType, contour_generator

    _, mask = cv2.threshold(window, 0, 1, cv2.THRESH_BINARY | cv2.THRESH_OTSU)
    if not 0 < int(mask.sum()) < mask.size:
        return "no contrast"
    above, below = float(window[mask > 0].mean()), float(window[mask == 0].mean())
    if above - below < _LEAST_CONTRAST:
        return f"no contrast: {above - below:.0f} grey levels, below {_LEAST_CONTRAST:.0f}"
    level = 0.5 * (above + below)
    given = light is not None
    if light is None:
        column, row = np.rint(place).astype(int)
        near = window[max(row - 1, 0) : row + 2, max(column - 1, 0) : column + 2]
        light = bool(np.median(near) > level)
    sign = 1.0 if light else -1.0
    grey = sign * window.astype(np.float64)
    contours = contour_generator(z=grey, fill_type=FillType.OuterOffset)
    filled: Any = contours.filled(sign * level, np.inf)
    patches, ends = filled
    nearest, curves = near_px, None
    for points, offsets in zip(patches, ends, strict=True):
        each = [points[a : b - 1] for a, b in pairwise(offsets)]
        away = _distance(each[:1] if given else each, place)
        if away < nearest:
            nearest, curves = away, each
    if curves is None:
        return "no patch there"
    return Patch(curves[0], tuple(curves[1:]), light, above - below, False)


def _distance(curves: list[FloatArray], place: FloatArray) -> float:
    """Return the distance of a point from a patch, px; 0 if it lies in it."""
    import cv2

    first, *holes = [curve.astype(np.float32)[:, None] for curve in curves]
    at = (float(place[0]), float(place[1]))
    if len(first) < 3:
        return float("inf")
    outside = [-cv2.pointPolygonTest(first, at, True)]
    outside += [cv2.pointPolygonTest(hole, at, True) for hole in holes if len(hole) >= 3]
    return max(0.0, *outside)
