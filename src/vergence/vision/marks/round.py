"""Round marks, dark on light or light on dark: the centroid to a fraction of a pixel.

The centroid of a circle's image is not the image of its centre, unless the circle faces the camera.
`circle_centre_bias` computes the difference, which grows with the square of the circle's size in
the image (some hundredths of a pixel for one of 10 px, a pixel for one of 100 px).
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from vergence.arrays import BoolArray, FloatArray, ImageArray, IntArray
from vergence.camera import Camera

FOUND, OUTSIDE, NO_CONTRAST, NO_MARK, CUT, NOT_ROUND = range(6)
REASONS = (
    "",
    "outside the image",
    "no contrast",
    "no mark near the prediction",
    "cut by its window",
    "not round",
)
LEAST_AREA = 6.0  # px²
ROUND_WITHIN = 0.15  # relative difference of the area from that of the ellipse of equal moments
LEAST_VARIANCE = 0.03**2  # px²


class RoundMarks(NamedTuple):
    """The measurements in the windows of one image."""

    points_px: FloatArray  # (M, 2) centroids; the predicted position if nothing was found
    covariance_px: FloatArray  # (M, 2, 2) px²
    found: BoolArray  # (M,)
    reasons: tuple[str, ...]  # (M,) empty if found, else why not
    area_px: FloatArray  # (M,) px²; 0 if nothing was found


def measure_round_marks(
    image: ImageArray, predicted_px: FloatArray, half_px: FloatArray, contrast: float = 20.0
) -> RoundMarks:
    """Find round marks in windows.

    In each window the grey-level threshold is halfway between its brightest and darkest; the patch
    nearest to the prediction that touches no border is the mark. Weighting every pixel by the
    fraction that the mark covers makes the centroid independent of the threshold.

    Args:
        image: grey, (height, width).
        predicted_px: expected positions of the marks, (M, 2).
        half_px: half the width and height of the windows, (M, 2).
        contrast: smallest difference between mark and background, grey values.
    """
    places, covariances, codes, areas = _measure(
        np.ascontiguousarray(image),
        np.ascontiguousarray(predicted_px, dtype=np.float64),
        np.ascontiguousarray(half_px, dtype=np.float64),
        contrast,
    )
    reasons = tuple(REASONS[code] for code in codes)
    return RoundMarks(places, covariances, codes == FOUND, reasons, areas)


@njit(cache=True)
def _measure(
    image: ImageArray, predicted: FloatArray, half: FloatArray, contrast: float
) -> tuple[FloatArray, FloatArray, IntArray, FloatArray]:
    places, covariances = predicted.copy(), np.zeros((len(predicted), 2, 2))
    codes, areas = np.zeros(len(predicted), dtype=np.int64), np.zeros(len(predicted))
    height, width = image.shape
    for m in range(len(predicted)):
        u, v = predicted[m, 0], predicted[m, 1]
        if not (0.0 <= u <= width - 1.0 and 0.0 <= v <= height - 1.0):
            codes[m] = OUTSIDE
            continue
        left, right = max(int(u - half[m, 0]), 0), min(int(u + half[m, 0]) + 1, width - 1)
        top, bottom = max(int(v - half[m, 1]), 0), min(int(v + half[m, 1]) + 1, height - 1)
        window = image[top : bottom + 1, left : right + 1]
        codes[m], areas[m] = _centroid(
            window, u - left, v - top, contrast, places[m], covariances[m]
        )
        if codes[m] == FOUND:
            places[m, 0] += left
            places[m, 1] += top
        else:
            places[m], areas[m] = predicted[m], 0.0
    return places, covariances, codes, areas


@njit(cache=True)
def _centroid(
    window: ImageArray,
    u: float,
    v: float,
    contrast: float,
    place: FloatArray,
    covariance: FloatArray,
) -> tuple[int, float]:
    """Find the mark of a window, dark or light, nearest to (u, v); return its code and area."""
    low, high = float(window.min()), float(window.max())
    if high - low < contrast:
        return NO_CONTRAST, 0.0
    level = 0.5 * (low + high)
    code, nearest, area = NO_MARK, np.inf, 0.0
    labels = np.zeros(window.shape, dtype=np.int64)
    stack = np.empty((window.size, 2), dtype=np.int64)
    found, spread = np.empty(2), np.empty((2, 2))
    number = 0
    for row in range(window.shape[0]):
        for column in range(window.shape[1]):
            if labels[row, column]:
                continue
            number += 1
            count, cut = _fill(window, level, row, column, number, labels, stack)
            if count < LEAST_AREA:
                continue
            if cut:
                continue
            size = _moments(window, labels, number, stack[:count], low, high, level, found, spread)
            if size <= 0.0:
                continue
            distance = np.hypot(found[0] - u, found[1] - v)
            if distance >= nearest:
                continue
            determinant = spread[0, 0] * spread[1, 1] - spread[0, 1] ** 2
            ellipse = 4.0 * np.pi * np.sqrt(max(determinant, 0.0))
            if abs(size - ellipse) > ROUND_WITHIN * size:
                code = NOT_ROUND if code != FOUND else code
                continue
            code, nearest, area = FOUND, distance, size
            place[:] = found
            # One grey value of noise in each pixel of the rim moves the centroid by this much.
            variance = LEAST_VARIANCE + (4.0 / (high - low)) ** 2 / max(size, 1.0)
            covariance[:] = 0.0
            covariance[0, 0] = covariance[1, 1] = variance
    return code, area


@njit(cache=True)
def _fill(
    window: ImageArray,
    level: float,
    row: int,
    column: int,
    number: int,
    labels: IntArray,
    stack: IntArray,
) -> tuple[int, bool]:
    """Label the patch of a pixel; return its pixel count, and whether it touches the border."""
    bright = window[row, column] > level
    stack[0, 0], stack[0, 1] = row, column
    labels[row, column] = number
    count, done, cut = 1, 0, False
    while done < count:
        r, c = stack[done, 0], stack[done, 1]
        done += 1
        if r == 0 or c == 0 or r == window.shape[0] - 1 or c == window.shape[1] - 1:
            cut = True
        for k in range(4):
            y, x = r + (k == 0) - (k == 1), c + (k == 2) - (k == 3)
            inside = 0 <= y < window.shape[0] and 0 <= x < window.shape[1]
            if inside and labels[y, x] == 0 and (window[y, x] > level) == bright:
                labels[y, x] = number
                stack[count, 0], stack[count, 1] = y, x
                count += 1
    return count, cut


@njit(cache=True)
def _moments(
    window: ImageArray,
    labels: IntArray,
    number: int,
    pixels: IntArray,
    low: float,
    high: float,
    level: float,
    place: FloatArray,
    spread: FloatArray,
) -> float:
    """Fill centroid and second moments of a patch with its rim; return its area.

    A pixel is weighted by the fraction that the mark covers, according to its grey level. A patch
    that does not differ from its surroundings in brightness has no area.
    """
    rows, columns = window.shape
    bright = window[pixels[0, 0], pixels[0, 1]] > level
    inside, outside = (high, low) if bright else (low, high)
    top, bottom = max(pixels[:, 0].min() - 2, 0), min(pixels[:, 0].max() + 2, rows - 1)
    left, right = max(pixels[:, 1].min() - 2, 0), min(pixels[:, 1].max() + 2, columns - 1)
    inside = _level(window, labels, number, True, inside, top, bottom, left, right)
    outside = _level(window, labels, number, False, outside, top, bottom, left, right)
    total, su, sv, suu, suv, svv = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    if inside == outside:
        return 0.0
    for r in range(top, bottom + 1):
        for c in range(left, right + 1):
            share = (window[r, c] - outside) / (inside - outside)
            near = labels[r, c] == number
            for k in range(9):
                y, x = r + k // 3 - 1, c + k % 3 - 1
                if 0 <= y < rows and 0 <= x < columns and labels[y, x] == number:
                    near = True
            if not near or share <= 0.0:
                continue
            share = min(share, 1.0)
            total += share
            su += share * c
            sv += share * r
            suu += share * c * c
            suv += share * c * r
            svv += share * r * r
    if total <= 0.0:
        return 0.0
    u, v = su / total, sv / total
    place[0], place[1] = u, v
    spread[0, 0], spread[1, 1] = suu / total - u * u, svv / total - v * v
    spread[0, 1] = spread[1, 0] = suv / total - u * v
    return total


@njit(cache=True)
def _level(
    window: ImageArray,
    labels: IntArray,
    number: int,
    own: bool,
    fallback: float,
    top: int,
    bottom: int,
    left: int,
    right: int,
) -> float:
    """Return the mean grey of the pixels well inside a patch, or well outside it."""
    rows, columns = window.shape
    total, count = 0.0, 0
    for r in range(top, bottom + 1):
        for c in range(left, right + 1):
            pure = True
            for k in range(9):
                y, x = r + k // 3 - 1, c + k % 3 - 1
                if 0 <= y < rows and 0 <= x < columns and (labels[y, x] == number) != own:
                    pure = False
            if pure:
                total += window[r, c]
                count += 1
    return total / count if count else fallback


def circle_centre_bias(
    camera: Camera, centre: FloatArray, normal: FloatArray, radius: float
) -> FloatArray:
    """Return the offset of the centroid of a circle's image from its centre's image, (2,), px.

    Subtract it from a measured centroid to obtain the centre. Pinhole geometry; distortion is
    assumed constant over the circle.

    Args:
        camera: the camera's model.
        centre: of the circle, camera frame, (3,), m.
        normal: of its plane, camera frame, (3,).
        radius: of the mark, m.
    """
    n = np.asarray(normal, dtype=np.float64) / np.linalg.norm(normal)
    a = np.cross(n, [1.0, 0.0, 0.0] if abs(n[0]) < 0.9 else [0.0, 1.0, 0.0])
    a /= np.linalg.norm(a)
    # Plane coordinates (x, y, 1) of the circle to the image: p = H (x, y, 1).
    H = np.column_stack((radius * a, radius * np.cross(n, a), np.asarray(centre)))
    G = np.linalg.inv(H)
    C = G.T @ np.diag([1.0, 1.0, -1.0]) @ G  # the ellipse: pᵀ C p = 0
    middle = np.linalg.solve(C[:2, :2], -C[:2, 2])
    centre_px = camera.project(np.asarray(centre, dtype=np.float64)[None])[0]
    bias: FloatArray = camera.to_pixels(middle[None])[0] - centre_px
    return bias
