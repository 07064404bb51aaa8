"""Bright round marks on something dark: found by their level, placed by their centre of gravity."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vergence.arrays import BoolArray, FloatArray, ImageArray
from vergence.vision.image import grey_image
from vergence.vision.tracks import Tracks

CONTRAST = 40  # grey levels between mark and surroundings, at least
SMALLEST_PX = 6  # area of a mark
SEARCH_PX = 24  # how far a mark may be from where it is expected
FLOOR_PX = 0.05  # standard deviation that no centre of gravity beats


class _Mark(NamedTuple):
    centre_px: FloatArray  # (2,)
    variance_px: float  # of each coordinate
    radius_px: float


class MarkTracker:
    """Follows bright marks from picture to picture; one mark's place is its centre of gravity.

    A mark is the blob brighter than halfway between its darkest and brightest surroundings that
    lies nearest to where it is expected. The projection of a disc's centre is not the centre of its
    picture: seen from afar, as marks are, the difference is below a tenth of a pixel.

    Args:
        image: the first picture, (height, width) grey.
        points_px: roughly where the marks are in it, (M, 2); a click will do.
    """

    def __init__(self, image: ImageArray, points_px: FloatArray) -> None:
        self._points = np.array(points_px, dtype=np.float64)
        self._before = self._points.copy()
        self._radius = np.full(len(self._points), SEARCH_PX / 3.0)
        self._points = self.track(image, self._points).points_px
        self._before = self._points.copy()

    def track(self, image: ImageArray, predicted_px: FloatArray | None = None) -> Tracks:
        """Measure the marks in a new picture.

        Args:
            image: grey, (height, width).
            predicted_px: where to look, (M, 2); None to go on as between the last two pictures.
        """
        expected = 2 * self._points - self._before if predicted_px is None else predicted_px
        grey, reason = grey_image(image)
        count = len(expected)
        found, reasons = np.zeros(count, dtype=np.bool_), [reason] * count
        points, variance = np.array(expected), np.full(count, float(SEARCH_PX**2))
        for j in range(count):
            mark = reason if grey is None else _measure(grey, expected[j], self._radius[j])
            if isinstance(mark, _Mark):
                found[j], reasons[j] = True, ""
                points[j], variance[j] = mark.centre_px, mark.variance_px
                self._radius[j] = mark.radius_px
            else:
                reasons[j] = mark
        self._before = np.where(found[:, None], self._points, self._before)
        self._points = np.where(found[:, None], points, self._points)
        nothing = np.full(count, np.nan)
        covariance = variance[:, None, None] * np.eye(2)
        return Tracks(points, covariance, found, tuple(reasons), nothing, nothing)


def _measure(grey: ImageArray, expected: FloatArray, radius: float) -> _Mark | str:
    """Return the mark nearest to where it is expected, or why there is none."""
    import cv2

    reach = int(np.ceil(SEARCH_PX + 1.5 * radius))
    height, width = grey.shape
    u, v = np.round(expected).astype(int) if np.isfinite(expected).all() else (-1, -1)
    left, top = max(u - reach, 0), max(v - reach, 0)
    window = grey[top : max(v + reach + 1, 0), left : max(u + reach + 1, 0)]
    if not (0 <= u < width and 0 <= v < height) or min(window.shape) < 3:
        return "left the image"
    dark, bright = np.percentile(window, 5), float(window.max())
    if bright - dark < CONTRAST:
        return f"no mark: contrast {bright - dark:.0f} grey levels, {CONTRAST} are needed"
    _, labels, stats, centres = cv2.connectedComponentsWithStats(
        (window > 0.5 * (dark + bright)).astype(np.uint8), connectivity=8
    )
    distance = np.linalg.norm(centres - (expected - (left, top)), axis=1)
    distance[stats[:, cv2.CC_STAT_AREA] < SMALLEST_PX] = np.inf
    distance[_at_border(np.asarray(stats), window.shape)] = np.inf
    distance[0] = np.inf  # the surroundings
    nearest = int(np.argmin(distance))
    if distance[nearest] > SEARCH_PX:
        return f"no mark within {SEARCH_PX} px of where it is expected"
    return _centre(window, labels == nearest, dark, (left, top))


def _at_border(stats: NDArray[Any], shape: tuple[int, ...]) -> BoolArray:
    """Tell which blobs touch the border of the window: they may be cut off."""
    left, top, width, height = stats[:, 0], stats[:, 1], stats[:, 2], stats[:, 3]
    cut: BoolArray = (
        (left == 0) | (top == 0) | (left + width == shape[1]) | (top + height == shape[0])
    )
    return cut


def _centre(window: ImageArray, blob: BoolArray, dark: float, corner: tuple[int, int]) -> _Mark:
    """Return the centre of gravity of a blob and its soft rim."""
    import cv2

    rim = cv2.dilate(blob.astype(np.uint8), np.ones((5, 5), np.uint8))
    weight = np.where(rim > 0, np.clip(window - dark, 0.0, None), 0.0)
    total = weight.sum()
    rows, columns = np.indices(window.shape)
    u, v = (columns * weight).sum() / total, (rows * weight).sum() / total
    area = float(blob.sum())
    # Noise of n pixels of a disc of n pixels moves its centre by about 0.5 σ/√n of its contrast.
    variance = FLOOR_PX**2 + (0.5 / 100.0) ** 2 * area**0.5
    return _Mark(np.array([u + corner[0], v + corner[1]]), variance, np.sqrt(area / np.pi))
