"""A matcher of your own: in a cell beside it, matcher = "my_matcher:Orb" under [task].

OpenCV's ORB stands for any features that recognise the points of one image in another.
"""

from typing import Any

import cv2
import numpy as np

import vergence as vg
from vergence.vision.matching import Matches

NOTHING = np.zeros((0, 2))


@vg.part("matcher")
class Orb:
    """Matches points by binary descriptors: each other's nearest, and clearly the nearest."""

    features: int = vg.knob(2000, least=50, upto=20000)  # of each image at most
    distinct: float = vg.knob(0.8, above=0, upto=1)  # best distance over the second best, at most

    def describe(self, image: np.ndarray, mask: np.ndarray | None = None) -> Any:
        """Return the features of a grey image, where the mask (height, width) lets them be."""
        shown = None if mask is None else mask.astype(np.uint8)
        points, descriptors = cv2.ORB.create(self.features).detectAndCompute(image, shown)
        return np.array([point.pt for point in points]).reshape(-1, 2), descriptors

    def match(self, current: Any, desired: Any) -> Matches:
        """Match the features of the arm's image with those of the photograph, the surest first."""
        (points, a), (points_star, b) = current, desired
        if a is None or b is None or len(b) < 2:
            return Matches(NOTHING, NOTHING, "one image has no corners")
        back = {m.queryIdx: m.trainIdx for m in cv2.BFMatcher(cv2.NORM_HAMMING).match(b, a)}
        pairs = cv2.BFMatcher(cv2.NORM_HAMMING).knnMatch(a, b, k=2)
        sure = [
            one
            for one, two in pairs
            if one.distance < self.distinct * two.distance and back[one.trainIdx] == one.queryIdx
        ]
        sure.sort(key=lambda match: match.distance)
        now, then = [m.queryIdx for m in sure], [m.trainIdx for m in sure]
        return Matches(points[now], points_star[then], "" if sure else "no corner is recognised")


if __name__ == "__main__":
    cell = vg.load_cell("photograph").replace(task={"matcher": "my_matcher:Orb"})
    path = vg.plan(cell)
    print(f"{path.camera_length_m:.3f} m to the photograph" if path else path)
