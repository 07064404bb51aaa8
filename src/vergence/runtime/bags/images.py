"""Images in ROS messages."""

from io import BytesIO
from typing import Any

import numpy as np

from vergence.camera.encodings import PIXEL_BYTES, grey_image
from vergence.camera.grey_levels import grey_levels, grey_values, white_level
from vergence.camera.image_file import as_jpeg, require_size
from vergence.errors import NOTHING, Absent, InputError

_DEEP = ("mono16", "16UC1")
_QUALITY = 90


def pixel_array(message: Any, name: str) -> np.ndarray:
    """Return the grey pixels of a `sensor_msgs/Image` (height, width), 8 or 16 bits.

    Raises:
        InputError: if its encoding is not supported, it is too large, or it has too few bytes.
    """
    width, height, encoding = int(message.width), int(message.height), str(message.encoding)
    require_size(width, height, name)
    size = 2 if encoding in _DEEP else PIXEL_BYTES.get(encoding)
    if size is None:
        allowed = ", ".join((*PIXEL_BYTES, *_DEEP))
        raise InputError(name, "encoding", encoding[:50] or NOTHING, allowed)
    data, step, row = np.asarray(message.data, np.uint8), int(message.step), size * width
    whole = step * (height - 1) + row
    if not width or not height or step < row or len(data) < whole:
        given = f"{len(data)} bytes in rows of {step}"
        raise InputError(name, "", given, f"{width} x {height} pixels of {size} bytes")
    rows = np.lib.stride_tricks.as_strided(data, (height, row), (step, 1), writeable=False)
    block = np.ascontiguousarray(rows)
    if encoding in _DEEP:
        order = ">u2" if message.is_bigendian else "<u2"
        return block.view(order).astype(np.uint16)
    image = grey_image(block.tobytes(), encoding, width, height)
    assert image is not None
    return image


def decoded_image(data: Any, name: str) -> np.ndarray:
    """Return a JPEG or PNG file as OpenCV reads it.

    Raises:
        InputError: if it is incomplete, not an image, or too large.
    """
    import cv2
    from PIL import Image

    block = bytes(data)
    try:
        with Image.open(BytesIO(block), formats=("JPEG", "PNG")) as header:
            width, height = header.size
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError):
        raise InputError(name, "", Absent("no whole JPEG or PNG"), "an image") from None
    require_size(width, height, name)
    image = cv2.imdecode(np.frombuffer(block, np.uint8), cv2.IMREAD_UNCHANGED)
    if image is None:
        raise InputError(name, "", Absent("no whole JPEG or PNG"), "an image")
    return np.asarray(image)


def jpeg_of(raw: np.ndarray, name: str) -> bytes:
    """Return a grey image as JPEG."""
    values = grey_values(raw, name)
    return as_jpeg(grey_levels(values, white_level(values)), _QUALITY)
