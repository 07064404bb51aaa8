"""Image features with descriptors, and their matching between two images."""

from typing import NamedTuple

import numpy as np

from vergence.arrays import BoolArray, FloatArray, ImageArray
from vergence.errors import ShapeError
from vergence.vision.image import grey_image
from vergence.vision.matching.matcher import Matches

NO_TEXTURE = "no texture that could be recognised"
_NOTHING = np.zeros((0, 2))


class ImageFeatures(NamedTuple):
    """The features of one image."""

    points_px: FloatArray  # (N, 2)
    descriptors: np.ndarray  # (N, D) float32
    reason: str = ""  # why there are none


def no_features(reason: str) -> ImageFeatures:
    """Return the features of an image that has none."""
    return ImageFeatures(_NOTHING, np.zeros((0, 1), np.float32), reason)


def searched_image(image: ImageArray, mask: BoolArray | None) -> tuple[ImageArray | None, str]:
    """Return the grey levels in which to search for features, or None and why there are none.

    Args:
        image: grey, (height, width).
        mask: where features may be, (height, width); None for everywhere.

    Raises:
        ShapeError: if the mask does not have the size of the image.
    """
    grey, reason = grey_image(image)
    if grey is not None and mask is not None and np.shape(mask) != grey.shape:
        raise ShapeError("mask", np.shape(mask), grey.shape)
    return grey, reason


def nearest_features(
    current: ImageFeatures, desired: ImageFeatures, distinct: float, count: int
) -> Matches:
    """Match features that are mutual nearest neighbours, clearly nearer than the second nearest.

    Args:
        current: of the current image.
        desired: of the desired image.
        distinct: largest ratio of the distances to the nearest and to the second nearest.
        count: largest number of matches, the best first.
    """
    for name, features in (("current", current), ("desired", desired)):
        if features.reason:
            return Matches(_NOTHING, _NOTHING, f"the {name} image: {features.reason}")
    a, b = current.descriptors, desired.descriptors
    squares = (a**2).sum(axis=1)[:, None] + (b**2).sum(axis=1) - 2.0 * (a @ b.T)
    rows = np.arange(len(a))
    best = squares.argmin(axis=1)
    first = np.maximum(squares[rows, best], 0.0)
    squares[rows, best] = np.inf
    second = np.maximum(squares.min(axis=1), 1e-9)
    squares[rows, best] = first
    mutual = squares.argmin(axis=0)[best] == rows
    ratio = np.sqrt(first / second)
    good = np.flatnonzero(mutual & (ratio < distinct))
    chosen = good[np.argsort(ratio[good], kind="stable")][:count]
    if not len(chosen):
        reason = "no feature of one image is recognised in the other"
        return Matches(_NOTHING, _NOTHING, reason)
    return Matches(current.points_px[chosen], desired.points_px[best[chosen]], "")
