"""The images of a folder as 8-bit grey levels on one scale."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from vergence.arrays import ImageArray
from vergence.camera.grey_levels import color_levels, grey_levels, grey_values, white_level
from vergence.camera.image_file import read_image_file
from vergence.errors import InputError

_SAMPLED = 8  # images that tell how deep all are


class LeveledImage(NamedTuple):
    """An image on the scale of its folder."""

    file: Path
    grey: ImageArray  # (height, width)
    color: ImageArray | None  # (height, width, 3) blue, green, red; None of a grey file


def grey_images(files: Sequence[Path]) -> Iterator[tuple[Path, ImageArray]]:
    """Yield the grey levels of `leveled_images`."""
    for image in leveled_images(files):
        yield image.file, image.grey


def leveled_images(files: Sequence[Path]) -> Iterator[LeveledImage]:
    """Yield images one by one, all of one size, their levels by one scale.

    The scale is that of the brightest of some images throughout the folder. An image that is
    brighter still raises it from there on.

    Raises:
        InputError: if one cannot be read, is too large, or differs in size or depth from the first.
    """
    first, white = None, _white(files)
    for file in files:
        raw = read_image_file(file)
        values = grey_values(raw, str(file))
        first = values if first is None else first
        require_like(values, first, str(file))
        white = white_level(values, white)
        yield LeveledImage(file, grey_levels(values, white), color_levels(raw, white))


def require_like(values: np.ndarray, first: np.ndarray, name: str) -> None:
    """Raise InputError if an image differs in size or depth from the first."""
    if values.shape != first.shape:
        given = f"{values.shape[1]} x {values.shape[0]} pixels"
        allowed = f"{first.shape[1]} x {first.shape[0]}, as the first image"
        raise InputError(name, "", given, allowed)
    if values.dtype != first.dtype:
        raise InputError(name, "", f"{values.dtype} values", f"{first.dtype}, as the first image")


def _white(files: Sequence[Path]) -> float:
    """Return the white level of some images; 0 where they are bytes, which have their own."""
    white = 0.0
    for file in files[:: max(1, len(files) // _SAMPLED)]:
        values = grey_values(read_image_file(file), str(file))
        if values.dtype == np.uint8:
            return white
        white = white_level(values, white)
    return white
