"""The pattern of a square marker, and the normal equations of fitting it to grey values.

The cells of a marker are known once its number is. Drawn through a homography and blurred by a
Gaussian, they make the expected image of the pattern:

    I(x) = d(p, q) + g(p, q) (B + c B (1 - B)),   B(x) = Σ_ij b_ij P_i(u) Q_j(v)

where G takes pixels x to p and q, -1 … 1 across the marker, and u and v are these in cells, with
a bend of the paper: u = n/2 (p + 1 + e_1 (1 - p²) + e_2 (1 - q² - 2/3)), v likewise. b_ij is 1
for a white cell in column i and row j, and around the marker; P_i and Q_j are what the blur takes
from a column and a row. The blur has a covariance in the image, so that it describes motion, too.
d and g, the darkest grey value and the range, are linear in p and q. c is the curve of the camera's
grey values: it widens what is white, and would make the marker smaller.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from vergence.arrays import FloatArray, ImageArray

UNKNOWNS = (
    22  # homography; blur xx, xy, yy; curve; darkest (3); lightest less darkest (3); bend (4)
)
_REACH = 3.5  # standard deviations of the blur, beyond which it takes nothing
_OUTLIER = 4.0  # residuals of so many standard deviations count for a quarter
_ROUGH = 0.32  # of the range of grey values: smaller ones are edges half a pixel off, not outliers
_BOW = 2.0 / 3.0  # mean of 1 - p² along a side: the line through a bowed one

_PER_DEVIATION = 128
_T = np.arange(-4 * _PER_DEVIATION, 4 * _PER_DEVIATION + 2) / _PER_DEVIATION
_DENSITY = np.exp(-0.5 * _T**2) / np.sqrt(2.0 * np.pi)
_SHARE = np.concatenate(((0.0,), np.cumsum(0.5 * (_DENSITY[1:] + _DENSITY[:-1]))))
_SHARE = _SHARE / _SHARE[-1]


@njit(cache=True, inline="always")
def _normal(t: float) -> tuple[float, float]:
    """Return share and density of the standard normal distribution up to t."""
    if t <= -4.0:
        return 0.0, 0.0
    if t >= 4.0:
        return 1.0, 0.0
    place = (t + 4.0) * _PER_DEVIATION
    k = int(place)
    a = place - k
    return _SHARE[k] + a * (_SHARE[k + 1] - _SHARE[k]), _DENSITY[k] + a * (
        _DENSITY[k + 1] - _DENSITY[k]
    )


@njit(cache=True, inline="always")
def _shares(u: float, s: float, n: int, out: FloatArray) -> tuple[int, int]:
    """Write what a blur takes from each column: share, first and second derivative by place.

    Args:
        u: place, columns from the first edge.
        s: standard deviation of the blur, columns.
        n: columns.
        out: (3, n), of which those between the first and the last column are written.
    """
    first = max(int(np.floor(u - _REACH * s)), 0)
    last = min(int(np.floor(u + _REACH * s)), n - 1)
    share, density = _normal((u - first) / s)
    slope, bend = density / s, -(u - first) * density / s**3
    for i in range(first, last + 1):
        t = u - i - 1.0
        share_i, density = _normal(t / s)
        slope_i, bend_i = density / s, -t * density / s**3
        out[0, i], out[1, i], out[2, i] = share - share_i, slope - slope_i, bend - bend_i
        share, slope, bend = share_i, slope_i, bend_i
    return first, last


class _Place(NamedTuple):
    """Where a pixel lies on the marker."""

    p: float  # -1 … 1 across the marker
    q: float
    u: float  # the same in cells, of bent paper
    v: float
    ux: float  # derivative by the pixel, cells per px
    uy: float
    vx: float
    vy: float


class _Blurred(NamedTuple):
    """The blurred cells at a place, with derivatives by the place in cells."""

    value: float
    u: float
    v: float
    uu: float
    vv: float
    uv: float


@njit(cache=True)
def _pixels_of(G: FloatArray, rim: float, image: ImageArray) -> tuple[int, int, int, int]:
    """Return the first and last column, and row, of the pixels up to a rim, -1 … 1 the marker."""
    corners = np.linalg.inv(G) @ np.array(
        [[-rim, rim, rim, -rim], [-rim, -rim, rim, rim], [1.0, 1.0, 1.0, 1.0]]
    )
    xs, ys = corners[0] / corners[2], corners[1] / corners[2]
    return (
        max(int(xs.min()), 0),
        min(int(xs.max()) + 1, image.shape[1] - 1),
        max(int(ys.min()), 0),
        min(int(ys.max()) + 1, len(image) - 1),
    )


@njit(cache=True, fastmath=True, inline="always")
def _place_of(G: FloatArray, x: int, y: int, light: FloatArray, half: float) -> _Place:
    """Return where a pixel lies on a marker of twice `half` cells."""
    w = G[2, 0] * x + G[2, 1] * y + G[2, 2]
    p = (G[0, 0] * x + G[0, 1] * y + G[0, 2]) / w
    q = (G[1, 0] * x + G[1, 1] * y + G[1, 2]) / w
    pp, qq = 1.0 - p * p, 1.0 - q * q
    return _Place(
        p,
        q,
        half * (p + 1.0 + light[10] * pp + light[11] * (qq - _BOW)),
        half * (q + 1.0 + light[12] * (pp - _BOW) + light[13] * qq),
        half * (G[0, 0] - p * G[2, 0]) / w,
        half * (G[0, 1] - p * G[2, 1]) / w,
        half * (G[1, 0] - q * G[2, 0]) / w,
        half * (G[1, 1] - q * G[2, 1]) / w,
    )


@njit(cache=True, fastmath=True, inline="always")
def _blur_at(at: _Place, light: FloatArray) -> tuple[float, float, float]:
    """Return the blur at a place: standard deviations across columns and rows, and covariance."""
    ux, uy, vx, vy = at.ux, at.uy, at.vx, at.vy
    su = np.sqrt(ux * ux * light[0] + 2.0 * ux * uy * light[1] + uy * uy * light[2])
    sv = np.sqrt(vx * vx * light[0] + 2.0 * vx * vy * light[1] + vy * vy * light[2])
    return su, sv, ux * vx * light[0] + (ux * vy + uy * vx) * light[1] + uy * vy * light[2]


@njit(cache=True, fastmath=True, inline="always")
def _row_of(
    cells: FloatArray, j: int, left: int, right: int, across: FloatArray
) -> tuple[float, float, float]:
    """Return what a blur across the columns makes of a row of cells, with two derivatives."""
    row, row_u, row_uu = 0.0, 0.0, 0.0
    for i in range(left, right + 1):
        black = cells[j, i] - 1.0
        row += black * across[0, i]
        row_u += black * across[1, i]
        row_uu += black * across[2, i]
    return row, row_u, row_uu


@njit(cache=True, fastmath=True, inline="always")
def _grey_value(at: _Place, seen: _Blurred, light: FloatArray, half: float, J: FloatArray) -> float:
    """Return the grey value that is expected at a place; write its derivatives J (22,)."""
    p, q, ux, uy, vx, vy = at.p, at.q, at.ux, at.uy, at.vx, at.vy
    B, curve = seen.value, light[3]
    shade = B + curve * B * (1.0 - B)
    gain = light[7] + light[8] * p + light[9] * q
    slope = gain * (1.0 + curve * (1.0 - 2.0 * B))
    a, b = slope * half * seen.u, slope * half * seen.v
    J[0], J[1], J[2] = a, a * p, a * q
    J[3], J[4], J[5] = b, b * p, b * q
    J[6], J[7] = p * (a * p + b * q), q * (a * p + b * q)
    J[8] = slope * (0.5 * (seen.uu * ux * ux + seen.vv * vx * vx) + seen.uv * ux * vx)
    J[9] = slope * (seen.uu * ux * uy + seen.vv * vx * vy + seen.uv * (ux * vy + uy * vx))
    J[10] = slope * (0.5 * (seen.uu * uy * uy + seen.vv * vy * vy) + seen.uv * uy * vy)
    J[11] = gain * B * (1.0 - B)
    J[12], J[13], J[14] = 1.0, p, q
    J[15], J[16], J[17] = shade, shade * p, shade * q
    pp, qq = 1.0 - p * p, 1.0 - q * q
    J[18], J[19], J[20], J[21] = a * pp, a * (qq - _BOW), b * (pp - _BOW), b * qq
    grey: float = (light[4] + light[5] * p + light[6] * q) + gain * shade
    return grey


@njit(cache=True, fastmath=True, inline="always")
def _block_of(at: _Place, n: int) -> int:
    """Return the number of the cell, or of the ring around them, that a place lies in."""
    block = min(max(int(np.floor(at.v)) + 1, 0), n + 1) * (n + 2)
    return block + min(max(int(np.floor(at.u)) + 1, 0), n + 1)


@njit(cache=True, fastmath=True)
def normal_equations(
    image: ImageArray,
    cells: FloatArray,
    G: FloatArray,
    light: FloatArray,
    noise: float,
    quiet: float,
    thin: int,
    A: FloatArray,
    scores: FloatArray,
) -> tuple[int, float, float]:
    """Add up the normal equations of a marker's pattern over the pixels of an image.

    Args:
        image: grey, (height, width).
        cells: 0 for black, 1 for white, (n, n), the black border with them.
        G: homography from pixels to the marker, whose corners are at -1 and 1.
        light: blur, curve, darkest, lightest less darkest, bend, (14,).
        noise: standard deviation of the grey values, for weights.
        quiet: cells around the marker that are white.
        thin: of so many pixels one is used.
        A: (22, 22), is written.
        scores: (cells and a ring around them, 22), is written: sums of weight, residual, Jacobian.

    Returns:
        count of pixels, sum of weights, and of weighted squared residuals.
    """
    n = len(cells)
    half = 0.5 * n
    A[:], scores[:] = 0.0, 0.0
    across, down, J = np.zeros((3, n)), np.zeros((3, n)), np.zeros(UNKNOWNS)
    count, weights, squares = 0, 0.0, 0.0
    rim = 1.0 + quiet / half
    first_x, last_x, first_y, last_y = _pixels_of(G, rim, image)
    step = max(int(0.618 * thin), 1)
    wide = max(_OUTLIER * noise, _ROUGH * abs(light[7]))
    for y in range(first_y, last_y + 1):
        for x in range(first_x, last_x + 1):
            if (x + step * y) % thin:
                continue
            at = _place_of(G, x, y, light, half)
            if abs(at.p) > rim or abs(at.q) > rim:
                continue
            su, sv, mixed = _blur_at(at, light)
            left, right = _shares(at.u, su, n, across)
            top, bottom = _shares(at.v, sv, n, down)
            B, Bu, Bv, Buu, Bvv, Buv = 1.0, 0.0, 0.0, 0.0, 0.0, 0.0
            for j in range(top, bottom + 1):
                row, row_u, row_uu = _row_of(cells, j, left, right, across)
                B += row * down[0, j]
                Bu += row_u * down[0, j]
                Buu += row_uu * down[0, j]
                Bv += row * down[1, j]
                Bvv += row * down[2, j]
                Buv += row_u * down[1, j]
            seen = _Blurred(B + mixed * Buv, Bu, Bv, Buu, Bvv, Buv)
            residual = image[y, x] - _grey_value(at, seen, light, half, J)
            weight = 1.0 / (1.0 + (residual / wide) ** 2) ** 2
            count += 1
            weights += weight
            squares += weight * residual * residual
            block = _block_of(at, n)
            for k in range(UNKNOWNS):
                weighted = weight * J[k]
                scores[block, k] += weighted * residual
                for m in range(k, UNKNOWNS):
                    A[k, m] += weighted * J[m]
    for k in range(UNKNOWNS):
        for m in range(k):
            A[k, m] = A[m, k]
    return count, weights, squares
