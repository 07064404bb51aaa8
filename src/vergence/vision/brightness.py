"""Brightens dark images, for thresholds in grey values."""

import numpy as np

from vergence.arrays import ImageArray

_WHITE = 200.0  # grey value of the brightest parts of an image after brightening
_BRIGHTEST = 0.99  # fraction of its pixels that are darker than those
_MOST = 12.0  # gain, beyond which only noise is amplified
_DARK = 1.5  # gain, below which an image is not changed
_SMOOTH_PX = 0.8  # standard deviation of the smoothing against noise
_EVERY = 4  # row and column that is evaluated


def gain_of(image: ImageArray) -> float:
    """Return the factor that makes the grey values of an image use their range, 1 … 12."""
    few = image[::_EVERY, ::_EVERY]
    counts = np.cumsum(np.bincount(few.ravel(), minlength=256))
    bright = int(np.searchsorted(counts, _BRIGHTEST * few.size)) if few.size else 255
    return float(np.clip(_WHITE / max(bright, 1), 1.0, _MOST))


def brightened(image: ImageArray, *, smooth: bool = False) -> ImageArray:
    """Return a dark grey image (height, width) brightened; the image itself if it is not dark.

    Args:
        image: grey.
        smooth: whether to smooth it as well, before rounding.
    """
    import cv2

    gain = gain_of(image)
    if gain <= _DARK:
        return image
    if smooth:
        blurred = cv2.GaussianBlur(image.astype(np.float32), (0, 0), _SMOOTH_PX)
        return np.asarray(cv2.convertScaleAbs(blurred, alpha=gain), np.uint8)
    return np.asarray(cv2.convertScaleAbs(image, alpha=gain), np.uint8)
