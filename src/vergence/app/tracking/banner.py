"""Words in the corner of an image."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

_FONT, _SCALE = 0, 0.45  # OpenCV's plain one
_LINE_PX, _MARGIN_PX = 16, 5
_WHITE = (255, 255, 255)


def draw_banner(canvas: NDArray[np.uint8], lines: Sequence[str]) -> None:
    """Write lines into the top left corner, white on black.

    Args:
        canvas: (height, width, 3).
        lines: at least one.
    """
    import cv2

    width = max(cv2.getTextSize(line, _FONT, _SCALE, 1)[0][0] for line in lines)
    corner = (width + 2 * _MARGIN_PX, _LINE_PX * len(lines) + _MARGIN_PX)
    cv2.rectangle(canvas, (0, 0), corner, 0, -1)
    for row, line in enumerate(lines, 1):
        place = (_MARGIN_PX, _LINE_PX * row - 1)
        cv2.putText(canvas, line, place, _FONT, _SCALE, _WHITE, 1, cv2.LINE_AA)
