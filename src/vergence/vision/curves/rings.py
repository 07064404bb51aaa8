"""Closed curves as rings of points, and a region with holes as a single closed curve."""

from collections.abc import Sequence

import numpy as np

from vergence.arrays import FloatArray

_SMOOTHED = range(-4, 5)  # px along a curve
_SAME = 1e-6  # px, between a point and itself


def signed_area(ring: FloatArray) -> float:
    """Return the area inside a ring (K, 2), positive if it turns from x to y."""
    x, y = ring.T
    return 0.5 * float(np.sum(np.roll(x, 1) * y - x * np.roll(y, 1)))


def resampled(ring: FloatArray, count: int) -> FloatArray:
    """Return points evenly spaced along a ring (K, 2), (count, 2).

    The first is the farthest on the ray from the centroid along x, and they turn from x to y, so
    they depend on the curve alone. The ring is smoothed over some pixels first, because pixel steps
    along it would count as length; its area and its centroid are preserved.
    """
    if signed_area(ring) < 0.0:
        ring = ring[::-1]
    rough = _closed(ring)
    lengths = _along(rough)
    fine = _at(rough, lengths, np.linspace(0.0, lengths[-1], max(int(lengths[-1]), count) + 1)[:-1])
    smooth = np.mean([np.roll(fine, shift, axis=0) for shift in _SMOOTHED], axis=0)
    closed = _closed(smooth)
    along = _along(closed)
    start = _on_ray(closed, along, centre_of(ring))
    points = _at(closed, along, (start + np.arange(count) * along[-1] / count) % along[-1])
    larger = np.sqrt(signed_area(ring) / signed_area(points))
    resized: FloatArray = centre_of(ring) + larger * (points - centre_of(points))
    return resized


def centre_of(ring: FloatArray) -> FloatArray:
    """Return the centroid of the area inside a ring (K, 2), (2,)."""
    about = ring.mean(axis=0)
    x, y = (ring - about).T
    before_x, before_y = np.roll(x, 1), np.roll(y, 1)
    twice = before_x * y - x * before_y
    total = 3.0 * twice.sum()
    centre: FloatArray = about + [((x + before_x) * twice).sum() / total,
                                  ((y + before_y) * twice).sum() / total]  # fmt: skip
    return centre


def joined_rings(rings: Sequence[FloatArray]) -> FloatArray:
    """Return an outline and its holes as one closed polygon, (M, 2).

    The outline, with its first point repeated; then each hole in the opposite direction, with its
    first point repeated, and back to the outline's first point. The connections enclose no area, so
    integrals over the interior are those of the region without its holes.
    """
    outline, *holes = rings
    if not holes:
        return outline
    parts = [outline, outline[:1]]
    for hole in holes:
        parts += [hole[:1], hole[:0:-1], hole[:1], outline[:1]]
    return np.concatenate(parts)


def rings_of(points: FloatArray) -> list[FloatArray]:
    """Return the outline and the holes that `joined_rings` joined into one polygon."""
    rings, start = [], 0
    while start < len(points):
        rest = points[start + 1 :]
        again = np.flatnonzero(np.abs(rest - points[start]).max(axis=1) < _SAME)
        end = start + 1 + again[0] if len(again) else len(points)
        rings.append(points[start:end])
        start = end + (2 if start else 1)  # the outline's first point follows each hole
    return rings


def inside_of(rings: Sequence[FloatArray]) -> FloatArray:
    """Return a point well inside a region, (2,): its centroid unless that is near an edge."""
    import cv2

    curves = [ring.astype(np.float32)[:, None] for ring in rings]

    def depth(place: FloatArray) -> float:
        at = (float(place[0]), float(place[1]))
        outer = cv2.pointPolygonTest(curves[0], at, True)
        return min([outer, *(-cv2.pointPolygonTest(hole, at, True) for hole in curves[1:])])

    outline = rings[0]
    middle = centre_of(outline)
    size = np.sqrt(abs(signed_area(outline)))
    if depth(middle) > 0.1 * size:
        return middle
    inner = rings[1] if len(rings) > 1 else outline
    pairs = 0.5 * (outline[:, None] + inner[None]).reshape(-1, 2)
    best: FloatArray = pairs[int(np.argmax([depth(place) for place in pairs]))]
    return best


def _closed(ring: FloatArray) -> FloatArray:
    return np.concatenate((ring, ring[:1]))


def _along(closed: FloatArray) -> FloatArray:
    """Return the arc length up to each point of a line (K, 2), (K,)."""
    steps = np.linalg.norm(np.diff(closed, axis=0), axis=1)
    return np.concatenate(([0.0], np.cumsum(steps)))


def _at(closed: FloatArray, along: FloatArray, places: FloatArray) -> FloatArray:
    """Return a line's points at given arc lengths, (N, 2)."""
    return np.column_stack([np.interp(places, along, values) for values in closed.T])


def _on_ray(closed: FloatArray, along: FloatArray, centre: FloatArray) -> float:
    """Return the position on a ring at which the ray along x from its centroid leaves it last."""
    x, y = (closed - centre).T
    crosses = np.flatnonzero((y[:-1] < 0.0) != (y[1:] < 0.0))
    share = y[crosses] / (y[crosses] - y[crosses + 1])
    places = x[crosses] + share * (x[crosses + 1] - x[crosses])
    last = int(places.argmax())
    step = along[crosses[last] + 1] - along[crosses[last]]
    return float(along[crosses[last]] + share[last] * step)
