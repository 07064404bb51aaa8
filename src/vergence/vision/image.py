"""What counts as a usable image."""

import numpy as np

from vergence.arrays import ImageArray

SMALLEST_PX = 24  # the patch that is aligned


def grey_image(image: object) -> tuple[ImageArray | None, str]:
    """Return an image as contiguous grey levels, or None and the reason why it cannot be used.

    Grey levels that are no bytes are rounded and clipped to 0 … 255.
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
        return np.ascontiguousarray(array), ""
    if array.dtype.kind not in "biuf":
        return None, f"image without grey levels: {array.dtype}"
    if not np.isfinite(array).all():
        return None, "image not finite"
    return np.clip(np.rint(array), 0, 255).astype(np.uint8), ""
