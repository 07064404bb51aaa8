"""Ten objects without corners, as meshes: made here, so that nothing has to be shipped."""

from collections.abc import Callable

import numpy as np

from vergence.arrays import FloatArray, IntArray

Mesh = tuple[FloatArray, IntArray]  # vertices (V, 3), m; triangles (F, 3), outside in front
SIDES = 48


def swept(centres: FloatArray, across: FloatArray, up: FloatArray, closed: bool = False) -> Mesh:
    """Return a tube of rings: centre + across cos a + up sin a, each (R, 3).

    Args:
        centres: of the rings.
        across: half axis of each.
        up: the other.
        closed: whether the last ring meets the first; else both ends are closed by points.
    """
    angles = 2.0 * np.pi * np.arange(SIDES) / SIDES
    rings = (
        centres[:, None]
        + np.cos(angles)[:, None] * across[:, None]
        + np.sin(angles)[:, None] * up[:, None]
    )
    count = len(centres)
    k = np.arange(SIDES)
    after = (k + 1) % SIDES
    triangles = []
    for ring in range(count if closed else count - 1):
        low, high = ring * SIDES, (ring + 1) % count * SIDES
        triangles += [np.column_stack((low + k, low + after, high + after))]
        triangles += [np.column_stack((low + k, high + after, high + k))]
    vertices = rings.reshape(-1, 3)
    if not closed:
        ends, last = len(vertices), (count - 1) * SIDES
        triangles += [np.column_stack((after, k, np.full(SIDES, ends)))]
        triangles += [np.column_stack((last + k, last + after, np.full(SIDES, ends + 1)))]
        vertices = np.vstack((vertices, centres[0], centres[-1]))
    return vertices, np.concatenate(triangles)


def turned(profile: FloatArray, flat: float = 1.0) -> Mesh:
    """Return a body of revolution around z.

    Args:
        profile: (radius, height) from one end to the other, (R, 2), m.
        flat: its extent along y as a share of that along x.
    """
    radius, height = profile.T
    zero = np.zeros_like(radius)
    return swept(
        np.column_stack((zero, zero, height)),
        np.column_stack((radius, zero, zero)),
        np.column_stack((zero, flat * radius, zero)),
    )


def joined(*meshes: Mesh) -> Mesh:
    """Return several meshes as one."""
    starts = np.cumsum([0, *(len(vertices) for vertices, _ in meshes[:-1])])
    return (
        np.vstack([vertices for vertices, _ in meshes]),
        np.vstack([faces + start for (_, faces), start in zip(meshes, starts, strict=True)]),
    )


def _rounded(half: tuple[float, float, float], power: float = 2.0) -> Mesh:
    """Return an ellipsoid, or with a greater power something between it and a box."""
    a = np.linspace(-np.pi / 2, np.pi / 2, 33)
    bow = np.sign(np.cos(a)) * np.abs(np.cos(a)) ** (2.0 / power)
    rise = np.sign(np.sin(a)) * np.abs(np.sin(a)) ** (2.0 / power)
    return turned(np.column_stack((half[0] * bow, half[2] * rise)), half[1] / half[0])


def _moved(mesh: Mesh, x: float, y: float, z: float) -> Mesh:
    return mesh[0] + (x, y, z), mesh[1]


def _bent(radius: float, thick: Callable[[FloatArray], FloatArray], span: float) -> Mesh:
    """Return a tube along an arc around y, its thickness by place 0 … 1 along it."""
    place = np.linspace(0.0, 1.0, 49)
    angle = span * (place - 0.5)
    zero = np.zeros_like(angle)
    outward = np.column_stack((np.cos(angle), zero, np.sin(angle)))
    half = thick(place)[:, None]
    across = np.column_stack((zero, np.ones_like(angle), zero))
    closed = span > 6.28
    rings = slice(0, -1 if closed else None)
    return swept((radius * outward)[rings], (half * outward)[rings], (half * across)[rings], closed)


def _handle(radius: float, thick: float, x: float) -> Mesh:
    return _moved(_bent(radius, lambda s: np.full_like(s, thick), np.pi * 1.15), x, 0.0, 0.0)


def _profile(*places: tuple[float, float]) -> FloatArray:
    return np.array(places)


def _smooth(*places: tuple[float, float]) -> FloatArray:
    from scipy.interpolate import PchipInterpolator

    radius, height = np.array(places).T
    t = np.linspace(0, 1, len(radius))
    fine = np.linspace(0, 1, 60)
    return np.column_stack([PchipInterpolator(t, v)(fine) for v in (radius, height)])


def _banana() -> Mesh:
    return _bent(0.08, lambda s: 0.004 + 0.017 * np.sin(np.pi * s) ** 0.6, 2.0)


def _duck() -> Mesh:
    beak = _rounded((0.018, 0.012, 0.006))
    head, tail = _rounded((0.025, 0.023, 0.024)), _rounded((0.018, 0.012, 0.02))
    return joined(
        _rounded((0.05, 0.035, 0.032)),
        _moved(head, 0.03, 0.0, 0.045),
        _moved(beak, 0.06, 0.0, 0.042),
        _moved(tail, -0.048, 0.0, 0.02),
    )


CAN = _profile((0.033, -0.058), (0.033, 0.058))
CUP = _profile((0.03, -0.045), (0.04, -0.04), (0.042, 0.045), (0.038, 0.045), (0.036, -0.035))
JUG = _smooth((0.03, -0.07), (0.05, -0.04), (0.048, 0.0), (0.028, 0.045), (0.034, 0.07))
BOTTLE = _smooth((0.034, -0.1), (0.035, -0.02), (0.03, 0.03), (0.012, 0.06), (0.012, 0.1))
PEAR = _smooth((0.004, -0.05), (0.034, -0.035), (0.038, -0.01), (0.018, 0.03), (0.003, 0.055))

OBJECTS: dict[str, Callable[[], Mesh]] = {
    "can": lambda: turned(CAN),
    "ball": lambda: _rounded((0.04, 0.04, 0.04)),
    "mug": lambda: joined(turned(CUP), _handle(0.026, 0.006, 0.04)),
    "jug": lambda: joined(turned(JUG), _handle(0.038, 0.007, 0.034)),
    "bottle": lambda: turned(BOTTLE),
    "ring": lambda: _bent(0.045, lambda s: np.full_like(s, 0.014), 2 * np.pi),
    "pebble": lambda: _rounded((0.06, 0.042, 0.028)),
    "banana": _banana,
    "pear": lambda: turned(PEAR, 0.85),
    "duck": _duck,
}
