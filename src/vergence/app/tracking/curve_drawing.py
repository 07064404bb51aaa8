"""Draws followed curves into their image."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from vergence.app.overlay import FOUND, LOST
from vergence.app.tracking.curve_follower import CurveFollower, CurveStep
from vergence.arrays import FloatArray, ImageArray

_SHIFT = 4  # fractional bits of a place
_INK = (20, 20, 20)
_FONT, _SCALE = 0, 0.4
_LINE_PX, _LETTER_PX = 15, 7


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
    cv2.rectangle(
        canvas, (0, 0), (_LETTER_PX * max(map(len, words)) + 8, _LINE_PX * len(words) + 4), 0, -1
    )
    for row, line in enumerate(words, 1):
        cv2.putText(
            canvas, line, (4, _LINE_PX * row - 2), _FONT, _SCALE, (255,) * 3, 1, cv2.LINE_AA
        )
    return canvas


def _label(
    canvas: NDArray[np.uint8], text: str, place_px: FloatArray, color: tuple[int, ...]
) -> None:
    """Write a curve's number at a place, moved into the image."""
    import cv2

    height, width = canvas.shape[:2]
    u, v = np.clip(place_px, (4, _LINE_PX), (width - 12, height - 6)).astype(int).tolist()
    for ink, thickness in ((_INK, 3), (color, 1)):
        cv2.putText(canvas, text, (u, v), _FONT, _SCALE, ink, thickness, cv2.LINE_AA)
