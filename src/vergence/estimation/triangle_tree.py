"""The surface of a target in nested boxes, so that a line of sight is tried with few triangles."""

from typing import NamedTuple

import numpy as np
from numba import njit

from vergence.arrays import FloatArray, IntArray

_LEAF = 8  # triangles in a box that is not divided further
_SLACK = 1e-9  # by which boxes are enlarged, relative to the surface: for rounding


class TriangleTree(NamedTuple):
    """Nested boxes around triangles: each box comes before those inside it."""

    low: FloatArray  # (N, 3) m
    high: FloatArray  # (N, 3) m
    after: IntArray  # (N,) the next box that is not inside this one
    first: IntArray  # (N,) the first triangle in it
    end: IntArray  # (N,) the one after its last; the first again for a box with boxes inside
    triangles: FloatArray  # (F, 3, 3) m
    planes: FloatArray  # (F, 4) of each a normal n and n · p of its points p


def triangle_tree(triangles: FloatArray) -> TriangleTree:
    """Return the nested boxes of triangles (F, 3, 3), each divided in half along its longest side.

    The triangles come back in another order.
    """
    order: list[int] = []
    everything = np.arange(len(triangles))
    boxes = _boxes(triangles, everything, 0, order) if len(triangles) else []
    ordered = np.array(triangles[order])
    normals = np.cross(ordered[:, 1] - ordered[:, 0], ordered[:, 2] - ordered[:, 0])
    heights = np.einsum("ni,ni->n", normals, ordered[:, 0])
    slack = _SLACK * float(np.ptp(triangles, axis=(0, 1)).max()) if len(triangles) else 0.0
    return TriangleTree(
        np.array([box.low for box in boxes]).reshape(-1, 3) - slack,
        np.array([box.high for box in boxes]).reshape(-1, 3) + slack,
        np.array([box.after for box in boxes], dtype=np.int64),
        np.array([box.first for box in boxes], dtype=np.int64),
        np.array([box.end for box in boxes], dtype=np.int64),
        ordered,
        np.column_stack((normals, heights)),
    )


class _Box(NamedTuple):
    low: FloatArray
    high: FloatArray
    after: int
    first: int
    end: int


def _boxes(triangles: FloatArray, inside: IntArray, before: int, order: list[int]) -> list[_Box]:
    """Return the box around some triangles and all boxes inside it, `before` others before them."""
    corners, first = triangles[inside], len(order)
    within: list[_Box] = []
    if len(inside) <= _LEAF:
        order += inside.tolist()
        end = len(order)
    else:
        centres = corners.sum(axis=1)
        along = centres[:, np.ptp(centres, axis=0).argmax()]
        for half in np.array_split(inside[np.argsort(along)], 2):
            within += _boxes(triangles, half, before + 1 + len(within), order)
        end = first
    low, high = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
    return [_Box(low, high, before + 1 + len(within), first, end), *within]


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def is_cut(tree: TriangleTree, origin: FloatArray, point: FloatArray, touching: float) -> bool:
    """Return whether a triangle cuts the segment from origin to point before its end.

    Args:
        tree: of the triangles.
        origin: (3,) m.
        point: (3,) m.
        touching: m, how near to the point a triangle does not count.
    """
    ox, oy, oz, px, py, pz = origin[0], origin[1], origin[2], point[0], point[1], point[2]
    x, y, z = px - ox, py - oy, pz - oz
    short_of = touching / np.sqrt(x * x + y * y + z * z)
    per_x, per_y, per_z = _per(x), _per(y), _per(z)
    box, low, high, planes = 0, tree.low, tree.high, tree.planes
    while box < len(tree.after):
        x0, x1 = (low[box, 0] - ox) * per_x, (high[box, 0] - ox) * per_x
        y0, y1 = (low[box, 1] - oy) * per_y, (high[box, 1] - oy) * per_y
        z0, z1 = (low[box, 2] - oz) * per_z, (high[box, 2] - oz) * per_z
        enters = max(max(min(x0, x1), min(y0, y1)), max(min(z0, z1), 0.0))
        leaves = min(min(max(x0, x1), max(y0, y1)), min(max(z0, z1), 1.0))
        if enters > leaves:
            box = tree.after[box]
            continue
        for n in range(tree.first[box], tree.end[box]):
            a, b, c, height = planes[n, 0], planes[n, 1], planes[n, 2], planes[n, 3]
            start, end = a * ox + b * oy + c * oz - height, a * px + b * py + c * pz - height
            crossed = start * end < 0.0 and abs(end) > short_of * (abs(start) + abs(end))
            if crossed and ray_hits(origin, point, tree.triangles[n], short_of):
                return True
        box += 1
    return False


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def _per(along: float) -> float:
    """Return 1 / along; for 0 so large a number that only boxes right on the line are met."""
    return 1.0 / along if abs(along) > 1e-300 else 1e300


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def ray_hits(origin: FloatArray, point: FloatArray, triangle: FloatArray, short_of: float) -> bool:
    """Return whether a triangle (3, 3) cuts the segment from origin to point before its end.

    Solves origin + t (point - origin) = a + β (b - a) + γ (c - a) for t < 1 - short_of
    (Möller and Trumbore).
    """
    dx, dy, dz = point[0] - origin[0], point[1] - origin[1], point[2] - origin[2]
    a, b, c = triangle[0], triangle[1], triangle[2]
    ex, ey, ez = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    fx, fy, fz = c[0] - a[0], c[1] - a[1], c[2] - a[2]
    px, py, pz = dy * fz - dz * fy, dz * fx - dx * fz, dx * fy - dy * fx
    determinant = ex * px + ey * py + ez * pz
    if determinant == 0.0:
        return False
    inverse = 1.0 / determinant
    sx, sy, sz = origin[0] - a[0], origin[1] - a[1], origin[2] - a[2]
    beta = (sx * px + sy * py + sz * pz) * inverse
    if beta < 0.0 or beta > 1.0:
        return False
    qx, qy, qz = sy * ez - sz * ey, sz * ex - sx * ez, sx * ey - sy * ex
    gamma = (dx * qx + dy * qy + dz * qz) * inverse
    if gamma < 0.0 or beta + gamma > 1.0:
        return False
    t = (fx * qx + fy * qy + fz * qz) * inverse
    hit: bool = 0.0 < t < 1.0 - short_of
    return hit
