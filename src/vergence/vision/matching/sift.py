"""Lowe's features, which are recognised despite rotation and changes of scale."""

from typing import Annotated

import numpy as np
from pydantic import Field

from vergence.arrays import BoolArray, ImageArray
from vergence.parts import knob, part
from vergence.vision.matching.image_features import (
    NO_TEXTURE,
    ImageFeatures,
    nearest_features,
    no_features,
    searched_image,
)
from vergence.vision.matching.matcher import Matches

_ROWS_PX = 480  # a larger image is searched at a smaller size


@part("matcher", "sift")
class Sift:
    """Matches points by Lowe's descriptors of their surroundings [Lowe2004].

    They are invariant to rotation about the optical axis and to scale, and nearly so up to about
    45° of tilt. A match must be the best in both directions and clearly better than the second
    best, so repeated texture gives few matches.
    """

    count: Annotated[int, Field(ge=8, le=2000)] = 100  # largest number of matches, the best first
    features: Annotated[int, Field(ge=8, le=20000)] = 1000  # per image at most
    size: float = knob(0.5, above=0.1, upto=1.0)  # scale of the searched image; 1 finds more
    distinct: float = knob(0.8, above=0.1, upto=1.0)  # largest best over second-best distance

    @property
    def finer(self) -> "Sift | None":
        """The same at full resolution, four times as slow."""
        if self.size == 1.0:
            return None
        return Sift(count=self.count, features=2 * self.features, size=1.0, distinct=self.distinct)

    def describe(self, image: ImageArray, mask: BoolArray | None = None) -> ImageFeatures:
        """Return the features of an image.

        Args:
            image: grey, (height, width).
            mask: where they may be, (height, width); None for everywhere.

        Raises:
            ShapeError: if the mask does not have the size of the image.
        """
        import cv2

        grey, reason = searched_image(image, mask)
        if grey is None:
            return no_features(reason)
        size = self.size * min(1.0, _ROWS_PX / min(grey.shape))
        if size < 1.0:
            grey = np.asarray(
                cv2.resize(grey, None, fx=size, fy=size, interpolation=cv2.INTER_AREA)
            )
        shown = None
        if mask is not None:
            rows, columns = grey.shape
            whole = (np.asarray(mask) != 0).astype(np.uint8)
            shown = cv2.resize(whole, (columns, rows), interpolation=cv2.INTER_NEAREST)
        detector = cv2.SIFT.create(nfeatures=self.features, enable_precise_upscale=True)
        points, descriptors = detector.detectAndCompute(grey, shown)
        if descriptors is None or len(points) < 2:
            return no_features(NO_TEXTURE)
        scale = np.array(image.shape[::-1]) / np.array(grey.shape[::-1])
        centres = np.array([point.pt for point in points], dtype=np.float64)
        return ImageFeatures((centres + 0.5) * scale - 0.5, descriptors)

    def match(self, current: ImageFeatures, desired: ImageFeatures) -> Matches:
        """Match two images by their features."""
        return nearest_features(current, desired, self.distinct, self.count)


def match_features(
    image: ImageArray,
    image_star: ImageArray,
    count: int = 100,
    *,
    mask: BoolArray | None = None,
    mask_star: BoolArray | None = None,
) -> Matches:
    """Match two images of a scene by `Sift`, at full resolution.

    Args:
        image: the current image, grey, (height, width).
        image_star: the desired image, grey, (height, width).
        count: largest number of matches.
        mask: where the object may be in the current image, (height, width); anywhere if None.
        mask_star: where it is in the desired image, (height, width); anywhere if None.

    Raises:
        ShapeError: if a mask does not have the size of its image.
    """
    sift = Sift(count=count, features=2000, size=1.0)
    return sift.match(sift.describe(image, mask), sift.describe(image_star, mask_star))
