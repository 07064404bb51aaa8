"""Points of one picture found again in another, however the camera was turned."""

from typing import NamedTuple

import numpy as np

from vergence.arrays import FloatArray, ImageArray
from vergence.vision.image import grey_image

DISTINCT = 0.8  # of the second best match's distance, which the best has to beat


class Matches(NamedTuple):
    """Matched points, the surest first; some may be wrong, which `estimate_two_view` finds out."""

    points_px: FloatArray  # (N, 2) in the first picture
    points_star_px: FloatArray  # (N, 2) in the second
    reason: str  # empty, or why there are none

    def __bool__(self) -> bool:
        """Whether any match was found."""
        return len(self.points_px) > 0


def match_features(image: ImageArray, image_star: ImageArray, count: int = 60) -> Matches:
    """Match features of two pictures of the same thing by what surrounds them.

    Lowe's descriptors, which a turn about the optical axis and a change of scale leave as they are;
    a match has to be the best in both directions and clearly better than the second best.

    Args:
        image: the current view, grey, (height, width).
        image_star: the desired view, likewise.
        count: how many matches at most.
    """
    import cv2

    nothing = np.zeros((0, 2))
    pictures = []
    for name, given in (("current", image), ("desired", image_star)):
        grey, reason = grey_image(given)
        if grey is None:
            return Matches(nothing, nothing, f"the {name} picture: {reason}")
        pictures.append(grey)
    detector = cv2.SIFT.create(nfeatures=2000)
    (here, first), (there, second) = (detector.detectAndCompute(p, None) for p in pictures)
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
        return Matches(nothing, nothing, "no feature of one picture is recognised in the other")
    return Matches(
        np.array([here[i].pt for _, i, _ in chosen], dtype=np.float64),
        np.array([there[j].pt for _, _, j in chosen], dtype=np.float64),
        "",
    )
