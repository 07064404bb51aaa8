"""The corners of a square marker where the lines along its sides meet, with covariance.

A corner itself is rounded by blur; the sides stay in the middle of their blur. Each side is
searched for across its whole length, and how far its places scatter about a line says how well the
line is known.
"""

import numpy as np

from vergence.arrays import FloatArray, ImageArray

_ENDS = 0.08  # of a side, next to its corners, that is left out: blur rounds it
_CELL = 0.1  # of a side: the marker's border is at least this wide
_STEP_PX = 0.25  # between samples of a profile
_LEAST_PX, _MOST_PX = 2.0, 7.0  # how far to both sides a profile reaches
_PROFILES = (8, 48)  # fewest and most of a side
_ACROSS, _ALONG = 2.0, 1.5  # smoothing against noise: samples of a profile, and profiles
_TOGETHER = 2.0 * np.sqrt(np.pi) * _ALONG  # profiles that this makes alike
_FLOOR_PX = 0.03  # standard deviation of a line: aliasing and lens, which do not average out
_APART = 0.024  # of a side: a step that is wider takes in what lies behind the border
_PULL = 0.8  # of what it is wider, by which that may move the line
_PASSES = 2


def refined_corners(
    image: ImageArray, corners_px: FloatArray, noise_px: float
) -> tuple[FloatArray, FloatArray]:
    """Return corners (4, 2), px, and their covariances (4, 2, 2), px², from the sides of a marker.

    Where the sides cannot be found, the corners stay, with four times the noise.

    Args:
        image: grey, (height, width).
        corners_px: where the corners are to some pixels, (4, 2), in order around the marker.
        noise_px: least standard deviation of a corner.
    """
    corners, covariance = corners_px, np.tile(np.eye(2) * (4.0 * noise_px) ** 2, (4, 1, 1))
    for _ in range(_PASSES):
        sides = [_side(image, corners, k) for k in range(4)]
        met = [_meet(sides[k - 1], sides[k]) for k in range(4)]
        places = np.array([place for place, _ in met])
        moved = np.linalg.norm(places - corners_px, axis=1)
        if not np.all(moved <= _MOST_PX):
            break
        corners, covariance = places, np.array([spread for _, spread in met])
        covariance = covariance + noise_px**2 * np.eye(2)
    return corners, covariance


def _side(image: ImageArray, corners: FloatArray, k: int) -> tuple[FloatArray, float, FloatArray]:
    """Return the line n·x = c along side k, and the variances of its offset at both corners."""
    import cv2

    a, b = corners[k], corners[(k + 1) % 4]
    length = float(np.linalg.norm(b - a))
    along = (b - a) / max(length, 1e-9)
    n = np.array([along[1], -along[0]])
    n *= np.sign(n @ (0.5 * (a + b) - corners.mean(axis=0))) or 1.0
    count = int(np.clip(length / 2.0, *_PROFILES))
    t = np.linspace(_ENDS, 1.0 - _ENDS, count)
    reach = float(np.clip(_CELL * length, _LEAST_PX, _MOST_PX))
    offset = np.arange(-reach, reach + _STEP_PX / 2, _STEP_PX)
    places = a + t[:, None, None] * (b - a) + offset[:, None] * n
    xy = np.asarray(places, np.float32)
    profiles = cv2.remap(image.astype(np.float32), xy[..., 0], xy[..., 1], cv2.INTER_LINEAR)
    profiles = cv2.GaussianBlur(profiles, (0, 0), sigmaX=_ACROSS, sigmaY=_ALONG)
    rise = np.maximum(np.diff(profiles.astype(np.float64), axis=1), 0.0)
    centres = 0.5 * (offset[1:] + offset[:-1])
    middle = _centroid(rise.mean(axis=0), centres)
    near = np.abs(centres - middle) <= 0.75 * reach
    weight = rise[:, near] ** 2 + 1e-9
    found = weight @ centres[near] / weight.sum(axis=1)
    keep = np.abs(found - np.median(found)) <= max(1.0, 0.5 * reach)
    design = np.column_stack((np.ones(count), t))[keep]
    if np.count_nonzero(keep) < _PROFILES[0] // 2:
        return n, np.nan, np.full(2, np.nan)
    solution, *_ = np.linalg.lstsq(design, found[keep], rcond=None)
    residual = found[keep] - design @ solution
    variance = _TOGETHER * float(residual @ residual) / max(len(residual) - 2, 1)
    C = variance * np.linalg.inv(design.T @ design)
    ends = np.array([(1.0, 0.0), (1.0, 1.0)])
    mean = rise[:, near].mean(axis=0)
    width = np.sqrt(np.average((centres[near] - middle) ** 2, weights=mean + 1e-9))
    pull = _PULL * max(width - _APART * length, 0.0)
    spread = np.einsum("ei,ij,ej->e", ends, C, ends) + _FLOOR_PX**2 + pull**2
    # The line through a + α n and b + β n, whose normal is turned by little.
    start, end = a + solution[0] * n, b + (solution[0] + solution[1]) * n
    direction = (end - start) / np.linalg.norm(end - start)
    normal = np.array([direction[1], -direction[0]])
    normal *= np.sign(normal @ n)
    return normal, float(normal @ start), spread


def _centroid(rise: FloatArray, centres: FloatArray) -> float:
    """Return where a side's mean profile rises: the centroid about its steepest place."""
    weight = rise**2
    return float(weight @ centres / max(weight.sum(), 1e-12))


def _meet(
    before: tuple[FloatArray, float, FloatArray], after: tuple[FloatArray, float, FloatArray]
) -> tuple[FloatArray, FloatArray]:
    """Return where the end of one side meets the start of the next, and its covariance."""
    N = np.array([before[0], after[0]])
    if abs(np.linalg.det(N)) < 0.2 or not np.isfinite(before[1] + after[1]):
        return np.full(2, np.nan), np.full((2, 2), np.nan)
    inverse = np.linalg.inv(N)
    variances = np.diag([before[2][1], after[2][0]])
    return inverse @ (before[1], after[1]), inverse @ variances @ inverse.T
