"""Meshes of MuJoCo's primitive geometry, faces counter-clockwise seen from outside."""

import numpy as np

from vergence.arrays import FloatArray, IntArray

SIDES = 48  # of a cylinder: its facets meet at 7.5°, which is not sharp


def box(half: FloatArray) -> tuple[FloatArray, IntArray]:
    """Return a box around the origin, its half lengths (3,) given, m."""
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
