"""The corners of a square marker, with covariance, from the pattern that its cells make."""

import numpy as np

from vergence.arrays import FloatArray, ImageArray
from vergence.vision.marks.pattern_fit import fit_pattern

_SQUARE = np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)], np.float32)
_PIXELS = 2000  # of a marker, that are used
_BLUR = (1.0, 0.25)  # standard deviation to start with: px at least, and cells
_DARK, _BRIGHT = 5.0, 95.0  # per cent of the grey values there: black and white to start with
_EXPLAINED = 0.5  # least share of the pixels that the pattern has to explain
_CONTRAST = 2.0  # least contrast over the residual
_UNREFINED = 0.5  # cells: standard deviation of a corner that the pattern does not place
_MOST_CELLS = 2.0  # farthest that a corner moves


def refined_corners(
    image: ImageArray, corners_px: FloatArray, cells: FloatArray, noise_px: float
) -> tuple[FloatArray, FloatArray]:
    """Return corners (4, 2), px, and their covariances (4, 2, 2), px², from a marker's pattern.

    Where the pattern does not match the image, the corners stay, uncertain by half a cell.

    Args:
        image: grey, (height, width).
        corners_px: where the corners are to some pixels, (4, 2), clockwise from the marker's own
            top left.
        cells: of the marker and its border, 0 for black, 1 for white, (n, n).
        noise_px: least standard deviation of a corner.
    """
    import cv2

    diagonals = corners_px[2:] - corners_px[:2]
    area = max(0.5 * abs(float(np.linalg.det(diagonals))), 1.0)
    cell = np.sqrt(area) / len(cells)
    uncertain = np.tile(np.eye(2) * ((_UNREFINED * cell) ** 2 + noise_px**2), (4, 1, 1))
    corner = np.maximum((corners_px.min(axis=0) - _MOST_CELLS * cell).astype(int), 0)
    right, bottom = (corners_px.max(axis=0) + _MOST_CELLS * cell).astype(int) + 1
    part = np.array(image[corner[1] : max(bottom, 0), corner[0] : max(right, 0)])
    if not part.size:
        return corners_px, uncertain
    dark, bright = np.percentile(part, (_DARK, _BRIGHT))
    blur = max(_BLUR[0], _BLUR[1] * cell) ** 2
    light = np.zeros(14)
    light[[0, 2, 4, 7]] = blur, blur, dark, max(bright - dark, 1.0)
    start = (corners_px - corner).astype(np.float32)
    G = np.array(cv2.getPerspectiveTransform(start, _SQUARE), np.float64)
    thin = int(np.ceil(area / _PIXELS))
    places, covariance, light, residual, explained = fit_pattern(part, cells, G, light, thin)
    places = places + corner
    far = np.abs(places - corners_px).max()
    contrast = light[7] - abs(light[8]) - abs(light[9])
    if explained < _EXPLAINED or contrast < _CONTRAST * residual or far > _MOST_CELLS * cell:
        return corners_px, uncertain
    spread = np.array([covariance[2 * k : 2 * k + 2, 2 * k : 2 * k + 2] for k in range(4)])
    return places, spread + noise_px**2 * np.eye(2)
