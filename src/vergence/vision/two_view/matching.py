"""Points of one image found again in another, however the camera was turned."""

from typing import NamedTuple

import numpy as np

from vergence.arrays import BoolArray, FloatArray, ImageArray
from vergence.errors import InputError
from vergence.vision.image import grey_image

_VIEWS = ("current", "desired")
DISTINCT = 0.8  # of the second best match's distance, which the best has to beat


class Matches(NamedTuple):
    """Matched points, the surest first; some may be wrong, which `estimate_two_view` finds out."""

    points_px: FloatArray  # (N, 2) in the current view
    points_star_px: FloatArray  # (N, 2) in the desired view
    reason: str  # empty, or why there are none

    def __bool__(self) -> bool:
        """Whether any match was found."""
        return len(self.points_px) > 0


def match_features(
    image: ImageArray,
    image_star: ImageArray,
    count: int = 60,
    *,
    mask: BoolArray | None = None,
    mask_star: BoolArray | None = None,
) -> Matches:
    """Match features of two images of the same thing by what surrounds them.

    Lowe's descriptors, which a turn about the optical axis and a change of scale leave as they are;
    a match has to be the best in both directions and clearly better than the second best.

    Args:
        image: the current view, grey, (height, width).
        image_star: the desired view, likewise.
        count: how many matches at most.
        mask: where the object may be in the current view, (height, width); by default anywhere.
        mask_star: where it is in the desired view, likewise.

    Raises:
        InputError: if a mask has not the size of its image.
    """
    import cv2

    nothing = np.zeros((0, 2))
    images = []
    for name, given in zip(_VIEWS, (image, image_star), strict=True):
        grey, reason = grey_image(given)
        if grey is None:
            return Matches(nothing, nothing, f"the {name} image: {reason}")
        images.append(grey)
    detector = cv2.SIFT.create(nfeatures=2000)
    (here, first), (there, second) = (
        detector.detectAndCompute(image, _mask_of(given, image, name))
        for image, given, name in zip(images, (mask, mask_star), _VIEWS, strict=True)
    )
    if first is None or second is None or min(len(first), len(second)) < 2:
        return Matches(nothing, nothing, "no texture that could be recognised")
    matcher = cv2.BFMatcher(cv2.NORM_L2)
    back = {m[0].queryIdx: m[0].trainIdx for m in matcher.knnMatch(second, first, k=1)}
    good = [
        (best.distance / max(next_best.distance, 1e-9), best.queryIdx, best.trainIdx)
        for best, next_best in matcher.knnMatch(first, second, k=2)
        if best.distance < DISTINCT * next_best.distance and back[best.trainIdx] == best.queryIdx
    ]
    chosen = sorted(good)[:count]
    if not chosen:
        return Matches(nothing, nothing, "no feature of one image is recognised in the other")
    return Matches(
        np.array([here[i].pt for _, i, _ in chosen], dtype=np.float64),
        np.array([there[j].pt for _, _, j in chosen], dtype=np.float64),
        "",
    )


def _mask_of(mask: BoolArray | None, image: ImageArray, name: str) -> ImageArray | None:
    """Return a mask as OpenCV takes it."""
    if mask is None:
        return None
    chosen = np.asarray(mask) != 0
    if chosen.shape != image.shape:
        raise InputError(
            "match_features", f"mask of the {name} view", f"{chosen.shape}", f"{image.shape}"
        )
    result: ImageArray = chosen.astype(np.uint8)
    return result
