"""Faults of an image in which nothing is recognised."""

from itertools import pairwise

import numpy as np

from vergence.arrays import ImageArray

_WHITE, _BLACK = 250, 5  # grey levels beyond which nothing is distinguished
_MOST = 0.4  # fraction of the image that may be white, or black
_CONTRAST = 4.0  # grey levels, standard deviation
_SHARP = 0.4  # contrast of the second octave relative to the fourth in a sharp image


def image_fault(image: ImageArray) -> str:
    """Return the fault that makes an image hard to recognise; empty if there is none.

    Args:
        image: grey, (height, width).
    """
    white, black = np.mean(image >= _WHITE), np.mean(image <= _BLACK)
    if white > _MOST:
        return f"over-exposed: {100 * white:.0f} % of it is white"
    if black > _MOST:
        return f"too dark: {100 * black:.0f} % of it is black"
    if float(np.std(image)) < _CONTRAST:
        return "without texture"
    return "blurred" if _is_blurred(image) else ""


def _is_blurred(image: ImageArray) -> bool:
    """Return whether the second octave of an image has much less contrast than the fourth.

    The first octave contains as much noise as detail.
    """
    import cv2

    levels = [image.astype(np.float32)]
    for _ in range(4):
        levels.append(np.asarray(cv2.pyrDown(levels[-1])))
    _, fine, _, coarse = (_detail(a, b) for a, b in pairwise(levels))
    return fine < _SHARP * coarse


def _detail(level: np.ndarray, smaller: np.ndarray) -> float:
    """Return the standard deviation of detail in a pyramid level beyond the next smaller one."""
    import cv2

    rows, columns = level.shape
    return float(np.std(level - cv2.pyrUp(smaller, dstsize=(columns, rows))))
