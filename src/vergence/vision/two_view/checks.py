"""Checks for unusable sets of matches, before any equation is solved."""

import numpy as np
from numba import njit

from vergence.arrays import FloatArray, IntArray


@njit(cache=True)
def distinct_count(points: FloatArray, tolerance: float) -> int:
    """Return how many of the points (N, D) are farther than the tolerance from all before them."""
    count = 0
    for j in range(len(points)):
        alone = True
        for i in range(j):
            if np.sum((points[j] - points[i]) ** 2) <= tolerance * tolerance:
                alone = False
                break
        count += alone
    return count


@njit(cache=True)
def fewest_off_a_line(points: FloatArray, tolerance: float) -> int:
    """Return the smallest number of points (N, 2) farther than the tolerance from any line.

    Every pair of points defines a line; above about sixty points only some of the pairs are tried.
    """
    count = len(points)
    stride = max(1, count * count // 3600)
    fewest, pair = count, 0
    for i in range(count):
        for j in range(i + 1, count):
            pair += 1
            x, y = points[j, 0] - points[i, 0], points[j, 1] - points[i, 1]
            length = np.hypot(x, y)
            if pair % stride != 0 or length <= tolerance:
                continue
            off = 0
            for k in range(count):
                aside = x * (points[k, 1] - points[i, 1]) - y * (points[k, 0] - points[i, 0])
                off += abs(aside) > tolerance * length
            fewest = min(fewest, off)
    return fewest


def width(points: FloatArray) -> float:
    """Return the root of the summed squared distances of points (K, 2) from their best line."""
    return float(np.linalg.svd(points - points.mean(axis=0))[1][1])


@njit(cache=True)
def triangle_area(points: FloatArray, a: int, b: int, c: int) -> float:
    """Return twice the area of the triangle of three of the points (N, 2)."""
    p, q, r = points[a], points[b], points[c]
    area: float = abs((q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0]))
    return area


@njit(cache=True)
def widest_triples(m_star: FloatArray, m: FloatArray, count: int) -> IntArray:
    """Return the triples of points, (count, 3), that span the largest triangles.

    The smaller of a triangle's areas in the two views counts. The triples are selected from at most
    sixteen points, spread over the list, and sorted with the best first.
    """
    stride = max(1, len(m) // 16)
    triples = np.zeros((count, 3), np.int64)
    areas = np.full(count, -1.0)
    for a in range(0, len(m), stride):
        for b in range(a + stride, len(m), stride):
            for c in range(b + stride, len(m), stride):
                area = min(triangle_area(m_star, a, b, c), triangle_area(m, a, b, c))
                worst = np.argmin(areas)
                if area > areas[worst]:
                    areas[worst] = area
                    triples[worst] = np.array([a, b, c])
    return triples[np.argsort(-areas)]
