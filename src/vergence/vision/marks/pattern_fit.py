"""The picture of a square marker, fitted to the grey values of an image.

The cells of a marker are known once its number is. Drawn through a homography and blurred by a
Gaussian, they make the picture that is expected:

    I(x) = d(p, q) + g(p, q) (B + c B (1 - B)),   B(x) = Σ_ij b_ij P_i(u) Q_j(v)

where G takes pixels x to p and q, -1 … 1 across the marker, and u and v are these in cells, with
a bend of the paper: u = n/2 (p + 1 + e_1 (1 - p²) + e_2 (1 - q² - 2/3)), v likewise. b_ij is 1
for a white cell in column i and row j, and around the marker; P_i and Q_j are what the blur takes
from a column and a row. The blur has a covariance in the image, so that it describes motion, too.
d and g, the darkest grey value and the range, are linear in p and q. c is the curve of the camera's
grey values: it widens what is white, and would make the marker smaller.

Gauss-Newton over all grey values, with weights that leave out what is not the marker, finds G,
bend, blur and light together: the estimate of maximum likelihood, with its covariance. Lines along
the outer sides alone are drawn off by what lies next to them as soon as the blur reaches it.
"""

import numpy as np
from numba import njit

from vergence.arrays import FloatArray, ImageArray

UNKNOWNS = (
    22  # homography; blur xx, xy, yy; curve; darkest (3); lightest less darkest (3); bend (4)
)
_BLUR, _CURVE, _BEND = 8, 11, 18  # where they begin
_REACH = 3.5  # standard deviations of the blur, beyond which it takes nothing
_PIXEL_PX2 = 1.0 / 12.0  # variance of a pixel's own square, the least of a blur
_MOST_CURVE = 0.9  # beyond 1, grey values would turn back
_CURVE_DEVIATION = 0.5  # a camera's gamma of 2.2 makes 0.6
_BEND_DEVIATION = 0.02  # of half a side: paper that is not quite flat
_OUTLIER = 4.0  # residuals of so many standard deviations count for a quarter
_ROUGH = 0.32  # of the range of grey values: smaller ones are edges half a pixel off, not outliers
_LEAST_NOISE = 0.3  # grey levels: rounding
_BOW = 2.0 / 3.0  # mean of 1 - p² along a side: the line through a bowed one
_STEPS = 25
_STRIDE = 0.6  # cells, the longest step of a corner
_NEAR_PX = 0.3  # step, below which all pixels are used
_CONVERGED_PX = 0.02  # step; what is left after it is a fraction
_SPOILT = 2.0  # deviations of the blur, nearer than which to the unknown nothing is used
_QUIET = (-0.6, 0.8)  # cells around the marker, fewest and most, that are used
_BLEEDING = 0.12  # of the blur by its square in cells: deviation by what shines in from outside
_LENS = 0.06  # of the blur: deviation by a lens whose blur is not a Gaussian

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
    """Add up the normal equations of a marker's picture over the pixels of an image.

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
    corners = np.linalg.inv(G) @ np.array(
        [[-rim, rim, rim, -rim], [-rim, -rim, rim, rim], [1.0, 1.0, 1.0, 1.0]]
    )
    xs, ys = corners[0] / corners[2], corners[1] / corners[2]
    step = max(int(0.618 * thin), 1)
    wide = max(_OUTLIER * noise, _ROUGH * abs(light[7]))
    for y in range(max(int(ys.min()), 0), min(int(ys.max()) + 1, len(image) - 1) + 1):
        for x in range(max(int(xs.min()), 0), min(int(xs.max()) + 1, image.shape[1] - 1) + 1):
            if (x + step * y) % thin:
                continue
            w = G[2, 0] * x + G[2, 1] * y + G[2, 2]
            p = (G[0, 0] * x + G[0, 1] * y + G[0, 2]) / w
            q = (G[1, 0] * x + G[1, 1] * y + G[1, 2]) / w
            if abs(p) > rim or abs(q) > rim:
                continue
            # In cells: place, its derivative by the pixel, and the blur across columns and rows.
            pp, qq = 1.0 - p * p, 1.0 - q * q
            bow_u, bow_v = qq - _BOW, pp - _BOW
            u = half * (p + 1.0 + light[10] * pp + light[11] * bow_u)
            v = half * (q + 1.0 + light[12] * bow_v + light[13] * qq)
            ux, uy = half * (G[0, 0] - p * G[2, 0]) / w, half * (G[0, 1] - p * G[2, 1]) / w
            vx, vy = half * (G[1, 0] - q * G[2, 0]) / w, half * (G[1, 1] - q * G[2, 1]) / w
            su = np.sqrt(ux * ux * light[0] + 2.0 * ux * uy * light[1] + uy * uy * light[2])
            sv = np.sqrt(vx * vx * light[0] + 2.0 * vx * vy * light[1] + vy * vy * light[2])
            mixed = ux * vx * light[0] + (ux * vy + uy * vx) * light[1] + uy * vy * light[2]
            left, right = _shares(u, su, n, across)
            top, bottom = _shares(v, sv, n, down)
            B, Bu, Bv, Buu, Bvv, Buv = 1.0, 0.0, 0.0, 0.0, 0.0, 0.0
            for j in range(top, bottom + 1):
                row, row_u, row_uu = 0.0, 0.0, 0.0
                for i in range(left, right + 1):
                    black = cells[j, i] - 1.0
                    row += black * across[0, i]
                    row_u += black * across[1, i]
                    row_uu += black * across[2, i]
                B += row * down[0, j]
                Bu += row_u * down[0, j]
                Buu += row_uu * down[0, j]
                Bv += row * down[1, j]
                Bvv += row * down[2, j]
                Buv += row_u * down[1, j]
            B += mixed * Buv
            curve = light[3]
            shade = B + curve * B * (1.0 - B)
            gain = light[7] + light[8] * p + light[9] * q
            residual = image[y, x] - (light[4] + light[5] * p + light[6] * q) - gain * shade
            slope = gain * (1.0 + curve * (1.0 - 2.0 * B))
            a, b = slope * half * Bu, slope * half * Bv
            J[0], J[1], J[2] = a, a * p, a * q
            J[3], J[4], J[5] = b, b * p, b * q
            J[6], J[7] = p * (a * p + b * q), q * (a * p + b * q)
            J[8] = slope * (0.5 * (Buu * ux * ux + Bvv * vx * vx) + Buv * ux * vx)
            J[9] = slope * (Buu * ux * uy + Bvv * vx * vy + Buv * (ux * vy + uy * vx))
            J[10] = slope * (0.5 * (Buu * uy * uy + Bvv * vy * vy) + Buv * uy * vy)
            J[11] = gain * B * (1.0 - B)
            J[12], J[13], J[14] = 1.0, p, q
            J[15], J[16], J[17] = shade, shade * p, shade * q
            J[18], J[19], J[20], J[21] = a * pp, a * bow_u, b * bow_v, b * qq
            weight = 1.0 / (1.0 + (residual / wide) ** 2) ** 2
            count += 1
            weights += weight
            squares += weight * residual * residual
            block = min(max(int(np.floor(v)) + 1, 0), n + 1) * (n + 2)
            block += min(max(int(np.floor(u)) + 1, 0), n + 1)
            for k in range(UNKNOWNS):
                weighted = weight * J[k]
                scores[block, k] += weighted * residual
                for m in range(UNKNOWNS):
                    A[k, m] += weighted * J[m]
    return count, weights, squares


@njit(cache=True)
def fit_pattern(
    image: ImageArray, cells: FloatArray, G: FloatArray, light: FloatArray, thin: int
) -> tuple[FloatArray, FloatArray, FloatArray, float, float]:
    """Fit a marker's picture to an image.

    Args:
        image: grey, (height, width).
        cells: 0 for black, 1 for white, (n, n), the black border with them.
        G: homography from pixels to the marker, whose corners are at -1 and 1, to start with.
        light: blur, curve, darkest, lightest less darkest, bend, (14,), to start with.
        thin: of so many pixels one is used.

    Returns:
        corners (4, 2), px; their covariance (8, 8), px²; light; residual, grey levels; the share
        of the pixels that the picture explains, 0 where the fit did not converge.
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
