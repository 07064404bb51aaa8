"""Image files: which there are, in the order in which they were taken, and reading one safely."""

import re
import warnings
from pathlib import Path

import numpy as np

from vergence.arrays import ImageArray
from vergence.errors import InputError

IMAGES = (".png", ".jpg", ".jpeg", ".pgm", ".ppm", ".bmp", ".tif", ".tiff", ".webp")
MOST_PIXELS = 100_000_000  # of an image; no sensor on an arm has more
_MOST_BYTES = 1_000_000_000
_JPEG_SCAN, _JPEG_END = b"\xff\xda", b"\xff\xd9"


def image_files(folder: Path) -> tuple[Path, ...]:
    """Return a folder's images in the natural order of their names: img2 before img10.

    Hidden files, whose names begin with a dot, are no images.

    Raises:
        InputError: if there are none.
    """
    files = [f for f in folder.iterdir() if f.suffix.lower() in IMAGES and f.name[0] != "."]
    if not files:
        raise InputError(str(folder), "", "a folder without images", ", ".join(IMAGES))
    return tuple(sorted(files, key=lambda file: natural_order(file.name)))


def natural_order(name: str) -> tuple[list[str | int], str]:
    """Return a key that sorts names with the numbers in them as numbers."""
    parts = re.split("([0-9]+)", name)  # words and numbers in turns
    words: list[str | int] = [int(p) if n % 2 else p.lower() for n, p in enumerate(parts)]
    return words, name


def as_jpeg(image: ImageArray, quality: int) -> bytes:
    """Return an image (height, width), or (height, width, 3) BGR, as a JPEG file.

    Args:
        image: 8 bits a value.
        quality: 1 to 100.
    """
    import cv2

    return bytes(cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, quality])[1])


def read_image_file(path: Path) -> np.ndarray:
    """Return an image as OpenCV reads it unchanged: grey, BGR or BGRA, of its own depth.

    Raises:
        InputError: if it is too large, cut off, or no image.
    """
    import cv2

    raw = _bytes(path)
    width, height = _size(raw, path)
    require_size(width, height, str(path))
    image = cv2.imdecode(np.frombuffer(raw, np.uint8), cv2.IMREAD_UNCHANGED)
    if image is None:
        raise InputError(
            str(path), "", "a file that cannot be read as an image", "a complete image file"
        )
    return np.asarray(image)


def require_size(width: int, height: int, source: str) -> None:
    """Raise InputError if an image has more pixels than any camera."""
    if width * height > MOST_PIXELS:
        allowed = f"at most {MOST_PIXELS // 1_000_000} megapixels"
        raise InputError(source, "", f"{width} x {height} pixels", allowed)


def _bytes(path: Path) -> bytes:
    with path.open("rb") as stream:
        raw = stream.read(_MOST_BYTES + 1)
    if len(raw) > _MOST_BYTES:
        allowed = f"at most {_MOST_BYTES // 1_000_000} MB"
        raise InputError(str(path), "", "a larger file", allowed)
    whole = raw.rfind(_JPEG_END) > raw.rfind(_JPEG_SCAN)
    if raw.startswith(b"\xff\xd8") and not whole:  # OpenCV fills up with grey
        raise InputError(str(path), "", "an image that is cut off", "a complete image file")
    return raw


def _size(raw: bytes, path: Path) -> tuple[int, int]:
    """Return width and height as the header has them; nothing is decoded."""
    from io import BytesIO

    from PIL import Image, UnidentifiedImageError

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", Image.DecompressionBombWarning)
            with Image.open(BytesIO(raw)) as header:
                return header.size
    except Image.DecompressionBombError:
        raise InputError(
            str(path), "", "an image of more than 178 megapixels", "a smaller image"
        ) from None
    except (UnidentifiedImageError, OSError, ValueError, SyntaxError):
        raise InputError(
            str(path), "", "a file that cannot be read as an image", "a complete image file"
        ) from None
