"""Draws followed curves into their image."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from vergence.app.overlay import FOUND, LOST
from vergence.app.tracking.banner import draw_banner
from vergence.app.tracking.curve_follower import CurveFollower, CurveStep
from vergence.arrays import FloatArray, ImageArray

_SHIFT = 4  # fractional bits of a place
_INK = (20, 20, 20)
_FONT, _SCALE = 0, 0.4  # OpenCV's plain one
_MARGIN_PX = (4, 15, 12, 6)  # of its place to the left, top, right and bottom


def draw_curves(
    image: ImageArray, time: float, followers: Sequence[CurveFollower], steps: Sequence[CurveStep]
) -> NDArray[np.uint8]:
    """Return the image in colour with the curves over it; a lost one where it was last found.

    Args:
        image: (height, width) grey.
        time: of it, s.
        followers: of the curves.
        steps: what was made of each.

    Returns:
        (height, width, 3) blue, green, red.
    """
    import cv2

    canvas = np.array(cv2.cvtColor(image, cv2.COLOR_GRAY2BGR), dtype=np.uint8)
    words = [f"{time:.2f} s"]
    for follower, step in zip(followers, steps, strict=True):
        color = FOUND if step.found else LOST
        outlines = follower.outlines(image)
        for points_px, closed in outlines:
            places = [np.rint(points_px * 2**_SHIFT).astype(np.int32)]
            for ink, width in ((_INK, 3), (color, 1)):
                cv2.polylines(canvas, places, closed, ink, width, cv2.LINE_AA, _SHIFT)
        _label(canvas, str(follower.number), outlines[0].points_px.mean(axis=0), color)
        if step.reason:
            words.append(f"{follower.title}: {step.reason}")
    draw_banner(canvas, words)
    return canvas


def _label(
    canvas: NDArray[np.uint8], text: str, place_px: FloatArray, color: tuple[int, ...]
) -> None:
    """Write a curve's number at a place, moved into the image."""
    import cv2

    height, width = canvas.shape[:2]
    left, top, right, bottom = _MARGIN_PX
    u, v = np.clip(place_px, (left, top), (width - right, height - bottom)).astype(int).tolist()
    for ink, thickness in ((_INK, 3), (color, 1)):
        cv2.putText(canvas, text, (u, v), _FONT, _SCALE, ink, thickness, cv2.LINE_AA)
