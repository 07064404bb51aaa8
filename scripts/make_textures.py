"""Draw the texture of the Puma cell's board: overlapping discs and polygons of every size.

Occluding shapes whose sizes follow an inverse cube law have detail at every scale, as natural
images do, so a feature tracker finds something to hold from near and from far.
"""

from pathlib import Path

import cv2
import numpy as np

SIZE = 1024
FOLDER = Path(__file__).parents[1] / "src" / "vergence" / "cells" / "puma560"


def dead_leaves(rng: np.random.Generator, size: int, count: int) -> np.ndarray:
    """Return a grey image (size, size), drawn back to front."""
    image = np.full((size, size), 128, np.uint8)
    smallest, largest = 6.0, size / 6
    share = rng.random(count)
    radius = 1 / np.sqrt(share / smallest**2 + (1 - share) / largest**2)
    for r in np.sort(radius)[::-1]:
        centre = rng.uniform(0, size, 2)
        grey = int(rng.integers(25, 231))
        if rng.random() < 0.4:
            cv2.circle(image, tuple(int(c) for c in centre), int(r), grey, -1, cv2.LINE_AA)
            continue
        angles = np.sort(rng.uniform(0, 2 * np.pi, int(rng.integers(3, 7))))
        corners = centre + r * np.column_stack((np.cos(angles), np.sin(angles)))
        cv2.fillPoly(image, [corners.astype(np.int32)], grey, cv2.LINE_AA)
    return image


if __name__ == "__main__":
    image = dead_leaves(np.random.default_rng(560), SIZE, 2500)
    cv2.imwrite(str(FOLDER / "leaves.png"), image, [cv2.IMWRITE_PNG_COMPRESSION, 9])
