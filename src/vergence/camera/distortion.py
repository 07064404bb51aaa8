"""The distortion model of Brown and Conrady, as OpenCV has it, in kernels.

With r² = x² + y²:

    x_d = x (1 + k1 r² + k2 r⁴ + k3 r⁶) + 2 p1 x y + p2 (r² + 2 x²)
    y_d = y (1 + k1 r² + k2 r⁴ + k3 r⁶) + p1 (r² + 2 y²) + 2 p2 x y
"""

import numpy as np
from numba import njit

from vergence.arrays import FloatArray

COEFFICIENTS = ("k1", "k2", "p1", "p2", "k3")
_STEPS = 12  # of Newton's method; three reach 1e-12 for ordinary lenses
_SETTLED = 1e-15  # normalized: a step that changes nothing any more


@njit(cache=True)
def distort(
    x: float, y: float, k1: float, k2: float, p1: float, p2: float, k3: float
) -> tuple[float, float]:
    """Return (x_d, y_d) of normalized (x, y)."""
    r2 = x * x + y * y
    radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))
    u = x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x)
    v = y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y
    return u, v


@njit(cache=True)
def distortion_slope(
    x: float, y: float, k1: float, k2: float, p1: float, p2: float, k3: float
) -> tuple[float, float, float]:
    """Return ∂x_d/∂x, ∂x_d/∂y = ∂y_d/∂x, and ∂y_d/∂y: the slope is symmetric."""
    r2 = x * x + y * y
    radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))
    growth = 2.0 * (k1 + r2 * (2.0 * k2 + r2 * 3.0 * k3))
    xx = radial + x * x * growth + 2.0 * p1 * y + 6.0 * p2 * x
    xy = x * y * growth + 2.0 * p1 * x + 2.0 * p2 * y
    yy = radial + y * y * growth + 6.0 * p1 * y + 2.0 * p2 * x
    return xx, xy, yy


@njit(cache=True)
def distort_points(points: FloatArray, k: FloatArray) -> FloatArray:
    """Return distorted coordinates (N, 2) of normalized ones (N, 2); k as in `COEFFICIENTS`."""
    out = np.empty((len(points), 2))
    for n in range(len(points)):
        out[n, 0], out[n, 1] = distort(points[n, 0], points[n, 1], k[0], k[1], k[2], k[3], k[4])
    return out


@njit(cache=True, error_model="numpy")
def undistort(
    x_d: float, y_d: float, k1: float, k2: float, p1: float, p2: float, k3: float
) -> tuple[float, float]:
    """Return (x, y), normalized, of distorted (x_d, y_d), by Newton's method."""
    x, y = x_d, y_d
    for _ in range(_STEPS):
        u, v = distort(x, y, k1, k2, p1, p2, k3)
        xx, xy, yy = distortion_slope(x, y, k1, k2, p1, p2, k3)
        du, dv = x_d - u, y_d - v
        determinant = xx * yy - xy * xy
        dx, dy = (yy * du - xy * dv) / determinant, (xx * dv - xy * du) / determinant
        x, y = x + dx, y + dy
        if abs(dx) + abs(dy) < _SETTLED:
            break
    return x, y


@njit(cache=True)
def undistort_points(distorted: FloatArray, k: FloatArray) -> FloatArray:
    """Return normalized coordinates (N, 2) of distorted ones (N, 2)."""
    out = np.empty((len(distorted), 2))
    for n in range(len(distorted)):
        x, y = distorted[n, 0], distorted[n, 1]
        out[n, 0], out[n, 1] = undistort(x, y, k[0], k[1], k[2], k[3], k[4])
    return out


@njit(cache=True)
def distortion_slopes(points: FloatArray, k: FloatArray) -> FloatArray:
    """Return ∂(x_d, y_d)/∂(x, y) at normalized coordinates (N, 2), (N, 2, 2)."""
    out = np.empty((len(points), 2, 2))
    for n in range(len(points)):
        xx, xy, yy = distortion_slope(points[n, 0], points[n, 1], k[0], k[1], k[2], k[3], k[4])
        out[n, 0, 0], out[n, 0, 1], out[n, 1, 0], out[n, 1, 1] = xx, xy, xy, yy
    return out


def distortion_reach(k: FloatArray) -> float:
    """Return the radius, normalized, up to which a point farther out appears farther out.

    Beyond it the model folds the image over: what lies far outside the field of view would seem
    to lie in it. Infinite where it never folds. Only the radial part counts.
    """
    # d(r radial)/dr = 1 + 3 k1 s + 5 k2 s² + 7 k3 s³ with s = r².
    roots = np.roots((7.0 * k[4], 5.0 * k[1], 3.0 * k[0], 1.0))
    real = roots.real[(np.abs(roots.imag) < 1e-12) & (roots.real > 0.0)]
    return float(np.sqrt(real.min())) if len(real) else np.inf
