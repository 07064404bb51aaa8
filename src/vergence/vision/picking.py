"""Selection of points that can be tracked well, [Nelson1995] section 2.3."""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from vergence.arrays import BoolArray, FloatArray, ImageArray, frozen
from vergence.vision.image import grey_image
from vergence.vision.pyramid import Patch

WINDOW = 8  # samples along a side of the window, at every level
LEVELS = (4, 2, 1)  # pixels averaged along each axis
BORDER_PX = 16  # half of the largest window
WEAKEST_GREY = 2.0  # grey levels per pixel: smaller gradients are considered noise
STRAIGHT = 0.02  # ratio of the eigenvalues below which a window shows an edge, not a corner
QUALITY = 0.02  # relative to the best point's worth


class Picked(NamedTuple):
    """Points for a tracker, the best first."""

    points_px: FloatArray  # (N, 2), N at most what was asked for
    worth: FloatArray  # (N,) grey levels per pixel: the weakest gradient over directions and levels
    reason: str  # empty if the requested number was found, else why not

    def __bool__(self) -> bool:
        """Whether any point was found."""
        return len(self.points_px) > 0


@njit(cache=True)
def weakest_gradient(image: Patch, window: int, out: FloatArray) -> None:
    """Compute the square root of the smaller eigenvalue of a window's mean gradient matrix.

    It is 0 on a straight edge, along which only noise has a gradient.

    Each element of out belongs to the window that starts at its row and column; [Tomasi1991].
    """
    height, width = image.shape
    xx, xy, yy = np.zeros((height, width)), np.zeros((height, width)), np.zeros((height, width))
    for i in range(1, height - 1):
        for j in range(1, width - 1):
            by_x = 0.5 * (image[i, j + 1] - image[i, j - 1])
            by_y = 0.5 * (image[i + 1, j] - image[i - 1, j])
            xx[i, j], xy[i, j], yy[i, j] = by_x * by_x, by_x * by_y, by_y * by_y
    a, b, c = weighted(xx, window), weighted(xy, window), weighted(yy, window)
    for i in range(height - window + 1):
        for j in range(width - window + 1):
            spread = np.sqrt((0.5 * (a[i, j] - c[i, j])) ** 2 + b[i, j] ** 2)
            middle = 0.5 * (a[i, j] + c[i, j])
            straight = middle - spread < STRAIGHT * (middle + spread)
            out[i, j] = 0.0 if straight else np.sqrt(max(middle - spread, 0.0))


@njit(cache=True)
def weighted(values: FloatArray, window: int) -> FloatArray:
    """Mean over windows with the largest weight in the centre, so that corners are centred."""
    return box_mean(box_mean(values, window // 2), window // 2 + 1)


@njit(cache=True)
def box_mean(values: FloatArray, window: int) -> FloatArray:
    """Mean over windows of a given size, each stored at its upper left."""
    height, width = values.shape
    total = np.zeros((height + 1, width + 1))
    for i in range(height):
        line = 0.0
        for j in range(width):
            line += values[i, j]
            total[i + 1, j + 1] = total[i, j + 1] + line
    out = np.zeros((height, width))
    n = window
    for i in range(height - n + 1):
        for j in range(width - n + 1):
            box = total[i + n, j + n] - total[i, j + n] - total[i + n, j] + total[i, j]
            out[i, j] = box / (n * n)
    return out


@njit(cache=True)
def worth_of_anchors(image: ImageArray) -> FloatArray:
    """Return the weakest gradient over all levels for the window at every anchor, (height, width).

    The levels have windows of 32, 16 and 16 px, as in the search.
    """
    height, width = image.shape
    out = np.zeros((height, width))
    out[BORDER_PX : height - BORDER_PX + 1, BORDER_PX : width - BORDER_PX + 1] = np.inf
    for block in LEVELS:
        rows, columns = height // block, width // block
        averaged = np.zeros((rows, columns), np.float32)
        for i in range(rows * block):
            for j in range(columns * block):
                averaged[i // block, j // block] += np.float32(image[i, j]) / (block * block)
        entries = 2 * WINDOW if block == 1 else WINDOW
        level, half = np.zeros((rows, columns)), entries * block // 2
        weakest_gradient(averaged, entries, level)
        for i in range(height):
            row = (i - half + block // 2) // block  # the nearest window of this level
            for j in range(width):
                column = (j - half + block // 2) // block
                inside = 0 <= row <= rows - entries and 0 <= column <= columns - entries
                out[i, j] = min(out[i, j], level[row, column] / np.sqrt(block) if inside else 0.0)
    return out


@njit(cache=True)
def spread_out(order: NDArray[np.int64], width: int, apart: float, count: int) -> FloatArray:
    """Select anchors in order, each at least a distance from all selected before; at most count."""
    out, taken = np.empty((count, 2)), 0
    for flat in order:
        x, y = flat % width, flat // width
        free = True
        for k in range(taken):
            if (out[k, 0] - x) ** 2 + (out[k, 1] - y) ** 2 < apart * apart:
                free = False
                break
        if free:
            out[taken, 0], out[taken, 1] = x, y
            taken += 1
            if taken == count:
                break
    return out[:taken]


def pick_features(
    image: ImageArray, count: int, mask: BoolArray | None = None, apart_px: float = 16.0
) -> Picked:
    """Select points of an image that are well-textured at every level of the tracker's pyramid.

    The worth of a point is the smallest, over the three levels, of the square root of the smaller
    eigenvalue of the mean gradient matrix [[Ix², Ix Iy], [Ix Iy, Iy²]]: the gradient in the weakest
    direction at the weakest level.

    Args:
        image: grey, (height, width).
        count: requested number of points.
        mask: where they may lie, (height, width); None for everywhere.
        apart_px: smallest distance between two of them.

    Returns:
        The points, the best first; fewer, or none, with the reason.

    Raises:
        ShapeError: if the mask does not have the shape of the image.
    """
    grey, reason = grey_image(image)
    nothing = np.zeros((0, 2)), np.zeros(0)
    if grey is None:
        return Picked(*nothing, reason)
    worth = worth_of_anchors(grey)
    if mask is not None:
        worth = np.where(frozen(mask, grey.shape, "mask") > 0, worth, 0.0)
    threshold = max(WEAKEST_GREY, QUALITY * float(worth.max(initial=0.0)))
    good = np.flatnonzero(worth >= threshold)
    if count < 1 or len(good) == 0:
        return Picked(*nothing, "no texture at all levels where points may lie" if count else "")
    order = good[np.argsort(-worth.ravel()[good], kind="stable")]
    anchors = spread_out(order, grey.shape[1], apart_px, count)
    rows, columns = anchors[:, 1].astype(int), anchors[:, 0].astype(int)
    found = len(anchors)
    few = f"only {found} of {count} points have texture at all levels {apart_px:g} px apart"
    return Picked(anchors - 0.5, worth[rows, columns], "" if found == count else few)
