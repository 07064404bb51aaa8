"""A square marker fitted to the grey values of an image.

Gauss-Newton over all grey values of the pattern that `normal_equations` draws, with weights that
leave out what is not the marker, finds homography, bend, blur and light together: the estimate of
maximum likelihood, with its covariance. Lines along the outer sides alone are drawn off by what
lies next to them as soon as the blur reaches it.
"""

import numpy as np
from numba import njit

from vergence.arrays import FloatArray, ImageArray
from vergence.vision.marks.pattern_equations import UNKNOWNS, normal_equations

_BLUR, _CURVE, _BEND = 8, 11, 18  # where they begin among the unknowns
_PIXEL_PX2 = 1.0 / 12.0  # variance of a pixel's own square, the least of a blur
_MOST_CURVE = 0.9  # beyond 1, grey values would turn back
_CURVE_DEVIATION = 0.5  # a camera's gamma of 2.2 makes 0.6
_BEND_DEVIATION = 0.02  # of half a side: paper that is not quite flat
_LEAST_NOISE = 0.3  # grey levels: rounding
_STEPS = 25
_STRIDE = 0.6  # cells, the longest step of a corner
_NEAR_PX = 0.3  # step, below which all pixels are used
_CONVERGED_PX = 0.02  # step; what is left after it is a fraction
_SPOILT = 2.0  # deviations of the blur, nearer than which to the unknown nothing is used
_QUIET = (-0.6, 0.8)  # cells around the marker, fewest and most, that are used
_BLEEDING = 0.12  # of the blur by its square in cells: deviation by what shines in from outside
_LENS = 0.06  # of the blur: deviation by a lens whose blur is not a Gaussian


@njit(cache=True)
def fit_pattern(
    image: ImageArray, cells: FloatArray, G: FloatArray, light: FloatArray, thin: int
) -> tuple[FloatArray, FloatArray, FloatArray, float, float]:
    """Fit a marker's pattern to an image.

    Args:
        image: grey, (height, width).
        cells: 0 for black, 1 for white, (n, n), the black border with them.
        G: homography from pixels to the marker, whose corners are at -1 and 1, to start with.
        light: blur, curve, darkest, lightest less darkest, bend, (14,), to start with.
        thin: of so many pixels one is used.

    Returns:
        corners (4, 2), px; their covariance (8, 8), px²; light; residual, grey levels; the share
        of the pixels that the pattern explains, 0 where the fit did not converge.
    """
    n = len(cells)
    light = light.copy()
    A = np.zeros((UNKNOWNS, UNKNOWNS))
    scores = np.zeros(((n + 2) * (n + 2), UNKNOWNS))
    places, covariance = _corners_of(G), np.zeros((8, 8))
    noise, coarse = 0.25 * abs(light[7]), 3
    for _ in range(_STEPS):
        cell = np.sqrt(_area(places)) / n
        blur = np.sqrt(max(light[0], light[2])) / cell
        quiet = min(max(1.0 - _SPOILT * blur, _QUIET[0]), _QUIET[1])
        count, weights, squares = normal_equations(
            image, cells, G, light, noise, quiet, coarse * thin, A, scores
        )
        if weights < 2 * UNKNOWNS:
            if coarse == 1:
                break
            coarse = 1
            continue
        noise = max(np.sqrt(squares / (weights - UNKNOWNS)), _LEAST_NOISE)
        b = scores.sum(axis=0)
        _expect(A, b, _CURVE, light, noise / _CURVE_DEVIATION)
        for k in range(_BEND, UNKNOWNS):
            _expect(A, b, k, light, noise / _BEND_DEVIATION)
        scale = 1.0 / np.sqrt(np.diag(A) + 1e-9)
        scaled = A * scale.reshape(-1, 1) * scale + 1e-9 * np.eye(UNKNOWNS)
        change = np.linalg.solve(scaled, b * scale) * scale
        D = _corner_jacobian(G, places)
        moved = np.abs(D @ change[:8]).max()
        change *= min(1.0, _STRIDE * cell / max(moved, 1e-12))
        G = _changed(G, change)
        _lighten(light, change[_BLUR:], cell * cell)
        places = _corners_of(G)
        if not np.isfinite(places).all():
            break
        if coarse > 1:
            coarse = coarse if moved > _NEAR_PX else 1
        elif moved < _CONVERGED_PX:
            inverse = np.linalg.inv(scaled) * scale.reshape(-1, 1) * scale
            alike = np.sum((scores @ inverse) * scores) / (UNKNOWNS * noise * noise)
            spread = np.ascontiguousarray(inverse[:8, :8]) * max(alike, 1.0) * noise * noise
            bias = (_LENS + _BLEEDING * blur * blur) * blur * cell
            covariance = D @ spread @ D.T + bias**2 * np.eye(8)
            return places, covariance, light, noise, weights / count
    return places, covariance, light, noise, 0.0


@njit(cache=True)
def _expect(A: FloatArray, b: FloatArray, k: int, light: FloatArray, root: float) -> None:
    """Add to the normal equations that an unknown is near zero, by the root of its weight."""
    A[k, k] += root * root
    b[k] -= root * root * light[k - _BLUR]


@njit(cache=True)
def _changed(G: FloatArray, d: FloatArray) -> FloatArray:
    """Return the homography after a change of places on the marker by eight numbers."""
    change = np.array([[1.0 + d[1], d[2], d[0]], [d[4], 1.0 + d[5], d[3]], [-d[6], -d[7], 1.0]])
    changed: FloatArray = change @ G
    changed /= changed[2, 2]
    return changed


@njit(cache=True)
def _lighten(light: FloatArray, change: FloatArray, most: float) -> None:
    """Change light, and keep its blur between a pixel's own and that of a cell, px²."""
    before = light.copy()
    light += change
    for k in (0, 2):
        light[k] = min(max(light[k], 0.3 * before[k], _PIXEL_PX2), 3.0 * before[k], most)
    bound = 0.95 * np.sqrt(light[0] * light[2])
    light[1] = min(max(light[1], -bound), bound)
    light[3] = min(max(light[3], -_MOST_CURVE), _MOST_CURVE)


@njit(cache=True)
def _corners_of(G: FloatArray) -> FloatArray:
    """Return the corners (4, 2) of the marker, px."""
    square = np.array([[-1.0, 1.0, 1.0, -1.0], [-1.0, -1.0, 1.0, 1.0], [1.0, 1.0, 1.0, 1.0]])
    found = np.linalg.inv(G) @ square
    return np.ascontiguousarray((found[:2] / found[2]).T)


@njit(cache=True)
def _area(corners: FloatArray) -> float:
    a, b = corners[2] - corners[0], corners[3] - corners[1]
    return max(0.5 * abs(float(a[0] * b[1] - a[1] * b[0])), 1.0)


@njit(cache=True)
def _corner_jacobian(G: FloatArray, corners: FloatArray) -> FloatArray:
    """Return how corners, px, move by the eight changes of the homography, (8, 8)."""
    D = np.zeros((8, 8))
    for k in range(4):
        x, y = corners[k]
        w = G[2, 0] * x + G[2, 1] * y + G[2, 2]
        p = (G[0, 0] * x + G[0, 1] * y + G[0, 2]) / w
        q = (G[1, 0] * x + G[1, 1] * y + G[1, 2]) / w
        M = np.array(
            [
                [(G[0, 0] - p * G[2, 0]) / w, (G[0, 1] - p * G[2, 1]) / w],
                [(G[1, 0] - q * G[2, 0]) / w, (G[1, 1] - q * G[2, 1]) / w],
            ]
        )
        change = np.array(
            [
                [1.0, p, q, 0.0, 0.0, 0.0, p * p, p * q],
                [0.0, 0.0, 0.0, 1.0, p, q, p * q, q * q],
            ]
        )
        D[2 * k : 2 * k + 2] = -np.linalg.inv(M) @ change
    return D
