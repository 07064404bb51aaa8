"""Meshes of MuJoCo's primitive geometry, faces counter-clockwise seen from outside."""

import numpy as np
from numpy.typing import ArrayLike

from vergence.arrays import FloatArray, IntArray

SIDES = 48  # of a cylinder: its facets meet at 7.5°, which is not sharp


def box(half: FloatArray) -> tuple[FloatArray, IntArray]:
    """Return a box around the origin, with half lengths (3,), m."""
    signs = np.array([[x, y, z] for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    triangles = [tri for a, b, c, d in quads for tri in ((a, b, c), (a, c, d))]
    return signs * np.asarray(half), np.array(triangles, dtype=np.int64)


def cylinder(radius: float, half_length: float) -> tuple[FloatArray, IntArray]:
    """Return a cylinder around z, m: its two rims are sharp, but have no corners."""
    angle = 2 * np.pi * np.arange(SIDES) / SIDES
    rim = np.column_stack((radius * np.cos(angle), radius * np.sin(angle)))
    low = np.column_stack((rim, np.full(SIDES, -half_length)))
    high = np.column_stack((rim, np.full(SIDES, half_length)))
    centres = np.array([[0.0, 0.0, -half_length], [0.0, 0.0, half_length]])
    triangles = []
    for k in range(SIDES):
        n = (k + 1) % SIDES
        triangles += [(k, n, SIDES + n), (k, SIDES + n, SIDES + k)]
        triangles += [(n, k, 2 * SIDES), (SIDES + k, SIDES + n, 2 * SIDES + 1)]
    return np.vstack((low, high, centres)), np.array(triangles, dtype=np.int64)


def ellipsoid(half: ArrayLike) -> tuple[FloatArray, IntArray]:
    """Return an ellipsoid around the origin, with half axes (3,), m."""
    angle = np.linspace(-np.pi / 2, np.pi / 2, SIDES // 2 + 1)
    unit, triangles = _turned(np.cos(angle), np.sin(angle))
    return unit * np.asarray(half), triangles


def capsule(radius: float, half_length: float) -> tuple[FloatArray, IntArray]:
    """Return a capsule around z: a cylinder of a half length, with hemispheres at its ends."""
    angle = np.linspace(-np.pi / 2, 0.0, SIDES // 4 + 1)
    bow, rise = radius * np.cos(angle), radius * np.sin(angle) - half_length
    return _turned(np.append(bow, bow[::-1]), np.append(rise, -rise[::-1]))


def _turned(radius: FloatArray, height: FloatArray) -> tuple[FloatArray, IntArray]:
    """Return a body of revolution around z from its profile, lowest first, closed at both ends."""
    angle = 2 * np.pi * np.arange(SIDES) / SIDES
    count = len(radius)
    vertices = np.column_stack(
        (
            np.outer(radius, np.cos(angle)).ravel(),
            np.outer(radius, np.sin(angle)).ravel(),
            np.repeat(height, SIDES),
        )
    )
    k = np.arange(SIDES)
    n = (k + 1) % SIDES
    triangles = []
    for ring in range(count - 1):
        low, high = ring * SIDES, (ring + 1) * SIDES
        if ring < count - 2:
            triangles.append(np.column_stack((low + k, high + n, high + k)))
        if ring > 0:
            triangles.append(np.column_stack((low + k, low + n, high + n)))
    return vertices, np.concatenate(triangles)
