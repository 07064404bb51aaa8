"""A calibration board of 6 × 6 circles in four real photographs, spoilt like everything else.

Right is a board whose centres a plane explains, but for a lens: within 2 px of a homography, as a
median. ViSP has no finder of boards of its own; its calibration calls OpenCV's.
"""

from collections.abc import Callable, Sequence

import numpy as np

from footage_rows import Row, median
from footage_tags import CASES
from real_images import IMAGES, read_grey
from vergence.arrays import FloatArray, ImageArray
from vergence.vision.board import Board

SIDE = 6
RIGHT_PX = 2.0
BOARD = Board(SIDE, SIDE, 0.03, pattern="circles")

Finder = Callable[[ImageArray], FloatArray | None]


def ours(image: ImageArray) -> FloatArray | None:
    seen = BOARD.find(image, "")
    return None if seen is None else seen.points_px


def opencv(image: ImageArray) -> FloatArray | None:
    import cv2

    found, centres = cv2.findCirclesGrid(image, (SIDE, SIDE))
    return np.asarray(centres, dtype=np.float64).reshape(-1, 2) if found else None


def off_plane(pixels: FloatArray) -> float:
    """Median distance of the centres from where a plane has them, px."""
    import cv2

    grid = BOARD.points[:, :2].astype(np.float32)
    H, _ = cv2.findHomography(grid, pixels.astype(np.float32))
    expected = np.asarray(cv2.perspectiveTransform(grid[None], H))[0]
    return float(np.median(np.linalg.norm(expected - pixels, axis=1)))


def row(case: str, who: str, find: Finder, images: Sequence[ImageArray]) -> Row:
    pixels = [found for found in map(find, images) if found is not None]
    off = [off_plane(found) for found in pixels]
    right = [each for each in off if each <= RIGHT_PX]
    lost = len(images) - len(off)
    return Row(
        "boards", case, who, len(images), len(right), len(off) - len(right), lost, median(right),
        "px",
    )  # fmt: skip


def rows() -> list[Row]:
    images = [read_grey(path) for path in sorted((IMAGES / "calibration").glob("grid36-*.pgm"))]
    found = []
    for case, spoil in CASES.items():
        chosen = [spoil(image, number) for number, image in enumerate(images)]
        own, peer = row(case, "vergence", ours, chosen), row(case, "OpenCV", opencv, chosen)
        holds = own.right >= peer.right and own.wrong == 0
        found += [Row(**own.record | {"aim": "no fewer than OpenCV", "holds": holds}), peer]
    return found
