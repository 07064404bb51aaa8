"""Collision checks of joint paths."""

from itertools import pairwise

import numpy as np

from vergence.arrays import FloatArray
from vergence.robot import Clearance

_LEAST = 1e-4  # rad or m: shorter segments of a path are not subdivided
_ROUNDING_M = 1e-9


def collision_at(bodies: Clearance, q: FloatArray) -> str:
    """Return which bodies are closer than their margin at joint positions q (n,), else ""."""
    return _too_near(bodies, bodies.distances(q))


def collision_along(bodies: Clearance, path: FloatArray) -> str:
    """Return which bodies are closer than their margin anywhere on a path (K, n), else "".

    On the straight joint segment between two waypoints, a pair keeps half its margin if what
    remains of its distance at both ends exceeds the change that the joints can cause, see
    `ClearBraking`; otherwise the segment is halved.
    """
    places = [(q, bodies.distances(q)) for q in path]
    reasons = (_too_near(bodies, distance) for _, distance in places)
    stretches = (_between(bodies, start, end) for start, end in pairwise(places))
    return next(filter(None, reasons), "") or next(filter(None, stretches), "")


def _too_near(bodies: Clearance, distance: FloatArray) -> str:
    """Return which pair is closer than its margin, given distances (P,), else ""."""
    room = distance - bodies.margin
    if not len(room) or room.min() >= -_ROUNDING_M:
        return ""
    pair = int(room.argmin())
    return f"{bodies.name(pair)} within {1e3 * bodies.margin[pair]:.1f} mm of each other"


def _between(
    bodies: Clearance, start: tuple[FloatArray, FloatArray], end: tuple[FloatArray, FloatArray]
) -> str:
    """Return which bodies collide between two positions, given the distances (P,) there."""
    change = np.abs(end[0] - start[0])
    room = start[1] + end[1] - bodies.margin
    if change.max() < _LEAST or (bodies.reach @ change < room).all():
        return ""
    q = 0.5 * (start[0] + end[0])
    middle = q, bodies.distances(q)
    return (
        _too_near(bodies, middle[1])
        or _between(bodies, start, middle)
        or _between(bodies, middle, end)
    )
