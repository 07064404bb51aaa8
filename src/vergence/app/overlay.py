"""Draws what was searched for, tracked, desired and true into a camera's image.

Pixel centres are at integers, here as everywhere; marks are placed to better than a
quarter of a pixel, which is what OpenCV's lines allow.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from vergence.arrays import BoolArray, FloatArray, ImageArray, IntArray
from vergence.runtime.results import CameraTrace
from vergence.signals import SearchWindows, curves_of

# Blue, green, red: Okabe and Ito's hues, brightened to stand out from grey textures.
FOUND = (150, 230, 20)
LOST = (10, 110, 255)
DESIRED = (66, 228, 240)
TRUE = (255, 200, 100)
WINDOW = (235, 235, 235)
UNASKED = (170, 170, 170)
_OUTLINE = (20, 20, 20)
_SHIFT = 4  # fractional bits of a place
_RADIUS_PX, _SMALL_PX = 8.0, 2.5
_THICK, _THIN = 4, 2  # px, of outline and ink
_FINE = 1  # px, of a window's frame


@dataclass(frozen=True, slots=True)
class Marks:
    """What there is to draw at one image; unknown points are NaN."""

    tracked_px: FloatArray  # (M, 2)
    found: BoolArray  # (M,)
    asked: BoolArray  # (M,) whether it was searched for
    windows: SearchWindows  # around the predicted places
    desired_px: FloatArray  # (M, 2)
    true_px: FloatArray  # (M, 2)
    joined: IntArray  # (M,) see `ImagePoints`: points of curves

    @classmethod
    def at(cls, trace: CameraTrace, time: float) -> Self:
        """Return the marks of the image nearest to a time of exposure."""
        row = int(np.argmin(np.abs(trace.time - time)))
        return cls(
            trace.points_px[row],
            trace.found[row],
            trace.asked[row],
            SearchWindows(trace.window_center_px[row], trace.window_half_px[row]),
            trace.desired_px[row],
            trace.true_px[row],
            trace.joined[row],
        )


def web_color(color: tuple[int, int, int]) -> str:
    """Return a colour of blue, green and red as a page writes it, such as "#14e696"."""
    return "#" + bytes(reversed(color)).hex()


def draw(image: ImageArray, marks: Sequence[Marks], width: int | None = None) -> NDArray[np.uint8]:
    """Return the image in colour with marks over it.

    Args:
        image: (height, width) grey.
        marks: where to draw, of each target.
        width: of what is returned, the image's own if None; marks keep their size.

    Returns:
        (…, width, 3) blue, green, red.
    """
    canvas = _colored(image, width or image.shape[1])
    scale = np.array(canvas.shape[1::-1]) / image.shape[::-1]
    for one in marks:
        _draw_marks(canvas, one, scale)
    return canvas


def _draw_marks(canvas: NDArray[np.uint8], marks: Marks, scale: FloatArray) -> None:
    for low, high in _corners(marks.windows, scale):
        _frame(canvas, low, high)
    if marks.joined.any():
        _draw_curves(canvas, marks, scale)
        return
    for point in _known(marks.tracked_px[~marks.asked], scale):
        _cross(canvas, point, UNASKED, _SMALL_PX, upright=False)
    for point in _known(marks.desired_px, scale):
        _cross(canvas, point, DESIRED, _RADIUS_PX + 1.0, upright=True)
    for point in _known(marks.true_px, scale):
        _circle(canvas, point, TRUE, 2.5)
    for point in _known(marks.tracked_px[marks.found], scale):
        _circle(canvas, point, FOUND, _RADIUS_PX)
    for point in _known(marks.tracked_px[marks.asked & ~marks.found], scale):
        _cross(canvas, point, LOST, _RADIUS_PX, upright=False)


def _draw_curves(canvas: NDArray[np.uint8], marks: Marks, scale: FloatArray) -> None:
    """Draw curves that are desired, true and found as lines."""
    import cv2

    found = np.where(marks.found[:, None], marks.tracked_px, np.nan)
    for curve in curves_of(marks.joined):
        for points_px, ink in ((marks.true_px, TRUE), (marks.desired_px, DESIRED), (found, FOUND)):
            places = _known(points_px[curve.points], scale)
            if len(places) < len(curve.points):
                continue
            line = [np.array([_fixed(place) for place in places], dtype=np.int32)]
            for color, thickness in ((_OUTLINE, _THICK), (ink, _THIN)):
                cv2.polylines(canvas, line, curve.closed, color, thickness, cv2.LINE_AA, _SHIFT)


def _colored(image: ImageArray, width: int) -> NDArray[np.uint8]:
    import cv2

    size = (width, round(image.shape[0] * width / image.shape[1]))
    method = cv2.INTER_AREA if width < image.shape[1] else cv2.INTER_LINEAR
    resized = cv2.resize(image, size, interpolation=method)
    return np.asarray(cv2.cvtColor(resized, cv2.COLOR_GRAY2BGR), dtype=np.uint8)


def _known(points_px: FloatArray, scale: FloatArray) -> FloatArray:
    """Return the points that can be drawn, as places in the resized image."""
    drawable = np.isfinite(points_px).all(axis=1) & (np.abs(points_px) < 1e4).all(axis=1)
    return np.asarray((points_px[drawable] + 0.5) * scale - 0.5)


def _corners(windows: SearchWindows, scale: FloatArray) -> Iterator[tuple[FloatArray, FloatArray]]:
    """Return the low and high corners of the windows that were opened, as places likewise."""
    center, half = windows
    corners = (_known(center + half * sign, scale) for sign in (-1.0, 1.0))
    return zip(*corners, strict=True)


def _frame(canvas: NDArray[np.uint8], low: FloatArray, high: FloatArray) -> None:
    import cv2

    corners = np.array([low, (high[0], low[1]), high, (low[0], high[1])])
    places = [np.array([_fixed(corner) for corner in corners], dtype=np.int32)]
    for ink, thickness in ((_OUTLINE, _THIN + _FINE), (WINDOW, _FINE)):
        cv2.polylines(canvas, places, True, ink, thickness, cv2.LINE_AA, _SHIFT)


def _circle(
    canvas: NDArray[np.uint8], center: FloatArray, color: tuple[int, ...], r: float
) -> None:
    import cv2

    place, radius = _fixed(center), round(r * 2**_SHIFT)
    for ink, thickness in ((_OUTLINE, _THICK), (color, _THIN)):
        cv2.circle(canvas, place, radius, ink, thickness, cv2.LINE_AA, _SHIFT)


def _cross(
    canvas: NDArray[np.uint8], center: FloatArray, color: tuple[int, ...], r: float, upright: bool
) -> None:
    import cv2

    arm = r * (np.array([1.0, 0.0]) if upright else np.array([1.0, 1.0]) / np.sqrt(2))
    across = np.array([-arm[1], arm[0]])
    for ink, thickness in ((_OUTLINE, _THICK), (color, _THIN)):
        for half in (arm, across):
            ends = _fixed(center - half), _fixed(center + half)
            cv2.line(canvas, *ends, ink, thickness, cv2.LINE_AA, _SHIFT)


def _fixed(point: FloatArray) -> tuple[int, int]:
    u, v = (round(float(value) * 2**_SHIFT) for value in point)
    return u, v
