"""Selects the recognised points to track, and interpolates depths between them."""

import numpy as np

from vergence.arrays import FloatArray, IntArray
from vergence.camera import Camera

_BORDER_PX = 24.0  # margin that the tracker's templates need
_NEAREST = 4  # known points from which the depth of a point is interpolated


def choose_points(
    points_px: FloatArray, points_star_px: FloatArray, camera: Camera, count: int
) -> IntArray:
    """Return the indices of well-spread matches, each the farthest from those before.

    Args:
        points_px: in the current image, (N, 2).
        points_star_px: in the desired image, (N, 2).
        camera: that took both.
        count: largest number of indices.
    """
    inside = camera.contains(points_px, _BORDER_PX) & camera.contains(points_star_px, _BORDER_PX)
    candidates = np.flatnonzero(inside)
    if len(candidates) <= count:
        return candidates
    here = points_px[candidates]
    chosen = [int(np.argmax(np.linalg.norm(here - here.mean(axis=0), axis=1)))]
    away = np.linalg.norm(here - here[chosen[0]], axis=1)
    while len(chosen) < count:
        chosen.append(int(away.argmax()))
        away = np.minimum(away, np.linalg.norm(here - here[chosen[-1]], axis=1))
    return candidates[chosen]


def depth_between(
    points: FloatArray, known_points: FloatArray, known_depth_m: FloatArray
) -> FloatArray:
    """Return the depth of points (N, 2) interpolated between known ones, (N,), m.

    Inverse depth is linear in the image of a plane; it is averaged over the nearest known points.

    Args:
        points: pixels or normalized coordinates.
        known_points: in the same coordinates, (K, 2).
        known_depth_m: their depths, (K,).
    """
    A = np.column_stack((known_points, np.ones(len(known_points))))
    inverse = 1.0 / known_depth_m
    plane = np.linalg.lstsq(A, inverse, rcond=1e-6)[0]
    rest = inverse - A @ plane
    distance = np.linalg.norm(points[:, None] - known_points[None], axis=2) + 1e-6
    nearest = np.argsort(distance, axis=1)[:, :_NEAREST]
    weight = 1.0 / np.take_along_axis(distance, nearest, axis=1) ** 2
    off = np.sum(weight * rest[nearest], axis=1) / weight.sum(axis=1)
    found = np.column_stack((points, np.ones(len(points)))) @ plane + off
    result: FloatArray = 1.0 / np.clip(found, 0.5 * inverse.min(), 2.0 * inverse.max())
    return result
