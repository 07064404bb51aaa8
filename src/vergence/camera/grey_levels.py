"""Images of any depth as 8-bit grey levels."""

from typing import Any

import numpy as np

from vergence.arrays import ImageArray
from vergence.errors import InputError

_WHITE = {  # what a camera may call white: 8, 10, 12, 14 or 16 bits, also in a deeper file
    "u": (255.0, 1023.0, 4095.0, 16383.0, 65535.0),
    "f": (1.0, 255.0, 1023.0, 4095.0, 16383.0, 65535.0),
}
_DEEP = ("uint16", "float32", "float64")
_GREY, _COLOUR = (1,), (3, 4)  # channels


def grey_values(raw: np.ndarray, name: str) -> np.ndarray:
    """Return an image's grey values in their own type, (height, width).

    Args:
        raw: as OpenCV reads it: grey, BGR, or BGR with alpha.
        name: for messages.

    Raises:
        InputError: if it has another type or number of channels, transparent pixels, or values
            that are not finite.
    """
    import cv2

    if raw.dtype != np.uint8 and raw.dtype.name not in _DEEP:
        raise InputError(name, "", f"values of kind {raw.dtype}", "8 or 16 bits, or floats")
    if raw.dtype.kind == "f":
        if not np.isfinite(raw).all():
            raise InputError(name, "", "values that are not finite", "an image of numbers")
        raw = raw.astype(np.float32)
    channels = 1 if raw.ndim == 2 else raw.shape[2]
    if channels == 1:
        return raw.reshape(raw.shape[:2])
    if channels not in _COLOUR:
        raise InputError(name, "", f"{channels} channels", "grey or colour")
    if channels == 4:
        opaque = 1.0 if raw.dtype.kind == "f" else np.iinfo(raw.dtype).max
        if raw[:, :, 3].min() < opaque:
            allowed = "an image without an alpha channel"
            raise InputError(name, "", "transparent pixels", allowed)
    code = cv2.COLOR_BGR2GRAY if channels == 3 else cv2.COLOR_BGRA2GRAY
    return np.asarray(cv2.cvtColor(raw, code))


def white_level(values: np.ndarray, at_least: float = 0.0) -> float:
    """Return which value is white in an image that is not brighter: the smallest usual one.

    Twelve bits in a 16-bit file have 4095 as white. One image may be dark: the white level of a
    sequence is that of its brightest image.

    Args:
        values: grey values.
        at_least: the white level of other images by the same camera.
    """
    if values.dtype == np.uint8:
        return 255.0
    brightest = max(float(values.max()), at_least)
    levels = _WHITE[values.dtype.kind]
    return next((white for white in levels if brightest <= white), brightest)


def grey_levels(values: np.ndarray, white: float) -> ImageArray:
    """Return grey values as bytes, 0 … white as 0 … 255."""
    if values.dtype == np.uint8:
        return np.ascontiguousarray(values)
    scaled: Any = np.rint(values * np.float32(255.0 / white))
    return np.ascontiguousarray(np.clip(scaled, 0.0, 255.0), dtype=np.uint8)


def color_levels(raw: np.ndarray, white: float) -> ImageArray | None:
    """Return the colours of an image as bytes, (height, width, 3) blue, green, red.

    Args:
        raw: as OpenCV reads it; what `grey_values` takes.
        white: the value that is white, of all channels.

    Returns:
        None if the image is grey.
    """
    if raw.ndim != 3 or raw.shape[2] not in _COLOUR:
        return None
    return grey_levels(np.ascontiguousarray(raw[:, :, :3]), white)
