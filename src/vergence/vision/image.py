"""Validation of images."""

import numpy as np

from vergence.arrays import ImageArray, read_only

SMALLEST_PX = 24  # side of the aligned patch
_BRIGHTEST = 300.0  # somewhat above 255, as after sharpening


def grey_image(image: object) -> tuple[ImageArray | None, str]:
    """Return an image as contiguous grey levels, or None and the reason why it cannot be used.

    It is read-only, like the images of a `Frame`: kernels are compiled for such once.

    Grey levels that are not bytes are rounded and clipped to 0 … 255. An image of 12 bits, or of
    floats from 0 to 1, would become white or black, and is rejected.
    """
    array = np.asarray(image)
    if image is None or array.size == 0:
        return None, "image empty"
    if array.ndim != 2:
        return None, f"image not grey: shape {array.shape}"
    if min(array.shape) < SMALLEST_PX:
        height, width = array.shape
        return None, f"image smaller than the window: {width} x {height}, {SMALLEST_PX} needed"
    if array.dtype == np.uint8:
        return read_only(array), ""
    if array.dtype.kind not in "biuf":
        return None, f"image without grey levels: {array.dtype}"
    if not np.isfinite(array).all():
        return None, "image not finite"
    brightest = float(array.max())
    if brightest > _BRIGHTEST or (array.dtype.kind == "f" and 0.0 < brightest <= 1.0):
        return None, f"image with levels up to {brightest:g}: scale them to 0 … 255"
    return read_only(np.clip(np.rint(array), 0, 255).astype(np.uint8)), ""
