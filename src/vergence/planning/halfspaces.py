"""Whether half-spaces have a point in common."""

import numpy as np
from numba import njit

from vergence.arrays import FloatArray

_CLOSE = 1e-9  # distance by which a point may be outside
_PARALLEL = 1e-12


@njit(cache=True, error_model="numpy")
def halfspaces_meet(G: FloatArray, h: FloatArray) -> bool:
    """Return whether G x ≥ h (rows, 3) has a solution x.

    The half-spaces are added one by one. If those so far meet in a point that violates the next
    one, they meet it on its plane or not at all, which reduces the problem to two dimensions, then
    to one.
    """
    x0 = x1 = x2 = 0.0
    for r in range(len(h)):
        if G[r, 0] * x0 + G[r, 1] * x1 + G[r, 2] * x2 >= h[r] - _CLOSE:
            continue
        k = 0
        for i in range(1, 3):
            if abs(G[r, i]) > abs(G[r, k]):
                k = i
        i, j = (k + 1) % 3, (k + 2) % 3
        if abs(G[r, k]) < _PARALLEL:
            return False
        met, u, v = _halfplanes_meet(G, h, r, k)
        if not met:
            return False
        w = (h[r] - G[r, i] * u - G[r, j] * v) / G[r, k]
        if k == 0:
            x0, x1, x2 = w, u, v
        elif k == 1:
            x0, x1, x2 = v, w, u
        else:
            x0, x1, x2 = u, v, w
    return True


@njit(cache=True, error_model="numpy")
def _halfplanes_meet(G: FloatArray, h: FloatArray, plane: int, k: int) -> tuple[bool, float, float]:
    """Return whether the rows before a plane's meet on it, and where: axes k + 1 and k + 2."""
    u = v = 0.0
    for r in range(plane):
        a, b, level = _on_plane(G, h, plane, k, r)
        if a * u + b * v >= level - _CLOSE:
            continue
        steep = abs(a) >= abs(b)  # the line is u as a function of v
        lead, other = (a, b) if steep else (b, a)
        if abs(lead) < _PARALLEL:
            return False, u, v
        low, high = -np.inf, np.inf
        for s in range(r):
            c, d, most = _on_plane(G, h, plane, k, s)
            share = (c if steep else d) / lead
            slope, least = (d if steep else c) - share * other, most - share * level
            if slope > _PARALLEL:
                low = max(low, least / slope)
            elif slope < -_PARALLEL:
                high = min(high, least / slope)
            elif least > _CLOSE:
                return False, u, v
        if low > high + _CLOSE:
            return False, u, v
        along = min(max(v if steep else u, low), high)
        across = (level - other * along) / lead
        u, v = (across, along) if steep else (along, across)
    return True, u, v


@njit(cache=True, error_model="numpy", inline="always")
def _on_plane(
    G: FloatArray, h: FloatArray, plane: int, k: int, row: int
) -> tuple[float, float, float]:
    """Return a, b, c of a row as a u + b v ≥ c on a plane."""
    i, j = (k + 1) % 3, (k + 2) % 3
    share = G[row, k] / G[plane, k]
    a, b = G[row, i] - share * G[plane, i], G[row, j] - share * G[plane, j]
    return a, b, h[row] - share * h[plane]
