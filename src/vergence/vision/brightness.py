"""Dark images, made as bright as others, for thresholds that are in grey values."""

import numpy as np

from vergence.arrays import ImageArray

_WHITE = 200.0  # what the brightest places of an image are brought to
_BRIGHTEST = 0.99  # of its pixels that are darker than those
_MOST = 12.0  # gain: beyond it there is nothing but noise
_DARK = 1.5  # gain, below which an image stays as it is
_SMOOTH_PX = 0.8  # standard deviation of the smoothing against noise
_EVERY = 4  # row and column that is looked at


def gain_of(image: ImageArray) -> float:
    """Return by what the grey values of an image are multiplied to use their range, 1 … 12."""
    few = image[::_EVERY, ::_EVERY]
    counts = np.cumsum(np.bincount(few.ravel(), minlength=256))
    bright = int(np.searchsorted(counts, _BRIGHTEST * few.size)) if few.size else 255
    return float(np.clip(_WHITE / max(bright, 1), 1.0, _MOST))


def brightened(image: ImageArray, *, smooth: bool = False) -> ImageArray:
    """Return a dark grey image (height, width) made bright; itself if it is not dark.

    Args:
        image: grey.
        smooth: whether it is smoothed, too, before it is rounded.
    """
    import cv2

    gain = gain_of(image)
    if gain <= _DARK:
        return image
    if smooth:
        blurred = cv2.GaussianBlur(image.astype(np.float32), (0, 0), _SMOOTH_PX)
        return np.asarray(cv2.convertScaleAbs(blurred, alpha=gain), np.uint8)
    return np.asarray(cv2.convertScaleAbs(image, alpha=gain), np.uint8)
