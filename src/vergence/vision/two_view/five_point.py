"""Essential matrices of five matches [Nister2004]: real roots of a polynomial of degree ten."""

import numpy as np
from numba import njit

from vergence.arrays import FloatArray, IntArray
from vergence.vision.two_view.polynomial import product_of, real_roots, value_at

_UNKNOWNS = "xyz1"  # E = x X + y Y + z Z + 1 W, of the null space of five epipolar constraints
_ELIMINATED = ("xxx", "yyy", "xxy", "xyy", "xxz", "xx1", "yyz", "yy1", "xyz", "xy1")
_KEPT = ("xzz", "xz1", "x11", "yzz", "yz1", "y11", "zzz", "zz1", "z11", "111")
_CUBICS = _ELIMINATED + _KEPT  # what is kept is x, y and 1, each times a polynomial in z


def _columns() -> IntArray:
    """Return the column (4, 4, 4) of each product of three unknowns."""
    columns = np.empty((4, 4, 4), dtype=np.int64)
    for place in np.ndindex(4, 4, 4):
        columns[place] = _CUBICS.index("".join(_UNKNOWNS[i] for i in sorted(place)))
    return columns


_COLUMN = _columns()


@njit(cache=True, error_model="numpy")
def five_point_matrices(samples: IntArray, m_star: FloatArray, m: FloatArray) -> FloatArray:
    """Return the essential matrices (M, 3, 3) of samples (S, 5) of matches, up to ten per sample.

    Args:
        samples: indices of the matches of each sample.
        m_star: points in the desired view, normalized, (N, 2).
        m: the same points in the current view, (N, 2): (m, 1)ᵀ E (m*, 1) = 0.
    """
    found = np.empty((10 * len(samples), 3, 3))
    count = 0
    for sample in samples:
        basis = _null_space(m_star[sample], m[sample])
        rest = _eliminated(_cubic_constraints(basis))
        rows = _rows_in_z(rest)
        for z in real_roots(_determinant(rows)):
            x, y, w = _null_vector(rows, z)
            E = x * basis[:, :, 0] + y * basis[:, :, 1] + w * (z * basis[:, :, 2] + basis[:, :, 3])
            size = np.sqrt(np.sum(E * E))
            if np.isfinite(size) and size > 0.0:
                found[count] = E / size
                count += 1
    return found[:count]


@njit(cache=True, error_model="numpy")
def _null_space(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return an orthonormal basis (3, 3, 4) of the matrices with (b, 1)ᵀ E (a, 1) = 0, five times.

    By Householder's reflections of the transposed constraints.
    """
    A, reflectors, basis = np.empty((9, 5)), np.zeros((5, 9)), np.zeros((9, 4))
    for k in range(5):
        right, left = (a[k, 0], a[k, 1], 1.0), (b[k, 0], b[k, 1], 1.0)
        for i in range(9):
            A[i, k] = left[i // 3] * right[i % 3]
    for k in range(5):
        v = reflectors[k]
        v[k:] = A[k:, k]
        v[k] += np.copysign(np.sqrt(np.sum(v * v)), v[k])
        v /= max(np.sqrt(np.sum(v * v)), 1e-300)
        for j in range(k, 5):
            A[:, j] -= 2.0 * np.sum(v * A[:, j]) * v
    for j in range(4):
        basis[5 + j, j] = 1.0
        for k in range(4, -1, -1):
            basis[:, j] -= 2.0 * np.sum(reflectors[k] * basis[:, j]) * reflectors[k]
    return basis.reshape(3, 3, 4)


@njit(cache=True, error_model="numpy")
def _cubic_constraints(E: FloatArray) -> FloatArray:
    """Return 2 E Eᵀ E - tr(E Eᵀ) E = 0 and det E = 0 as cubics (10, 20) of E (3, 3, 4)."""
    square, trace = np.zeros((3, 3, 4, 4)), np.zeros((4, 4))
    for i in range(3):
        for k in range(3):
            for r in range(3):
                for a in range(4):
                    for b in range(4):
                        square[i, k, a, b] += 2.0 * E[i, r, a] * E[k, r, b]
        trace += 0.5 * square[i, i]
    for i in range(3):
        square[i, i] -= trace
    cubics = np.zeros((10, 20))
    for a in range(4):
        for b in range(4):
            for c in range(4):
                column = _COLUMN[a, b, c]
                for i in range(3):
                    for j in range(3):
                        for k in range(3):
                            cubics[3 * i + j, column] += square[i, k, a, b] * E[k, j, c]
                    u, v = (i + 1) % 3, (i + 2) % 3
                    minor = E[1, u, b] * E[2, v, c] - E[1, v, b] * E[2, u, c]
                    cubics[9, column] += E[0, i, a] * minor
    return cubics


@njit(cache=True, error_model="numpy")
def _eliminated(cubics: FloatArray) -> FloatArray:
    """Return the last ten columns (10, 10) after the first ten became the identity."""
    for k in range(10):
        best = k + np.argmax(np.abs(cubics[k:, k]))
        if best != k:
            swapped = cubics[k].copy()
            cubics[k] = cubics[best]
            cubics[best] = swapped
        cubics[k] /= cubics[k, k]
        for i in range(10):
            if i != k:
                cubics[i] -= cubics[i, k] * cubics[k]
    return cubics[:, 10:].copy()


@njit(cache=True, error_model="numpy")
def _rows_in_z(rest: FloatArray) -> FloatArray:
    """Return equations a(z) x + b(z) y + c(z) = 0, coefficients in ascending powers (3, 3, 5).

    Each is the difference of a row with a monomial times z, and z times the row with the monomial.
    """
    rows = np.zeros((3, 3, 5))
    for k in range(3):
        upper, lower = rest[4 + 2 * k], rest[5 + 2 * k]
        for part in range(3):
            first, size = 3 * part, 3 if part < 2 else 4
            for p in range(size):
                rows[k, part, size - 1 - p] += upper[first + p]
                rows[k, part, size - p] -= lower[first + p]
    return rows


@njit(cache=True, error_model="numpy")
def _determinant(rows: FloatArray) -> FloatArray:
    """Return the determinant of three equations in x, y and 1, a polynomial in z, (11,)."""
    total = np.zeros(13)
    for k in range(3):
        u, v = rows[(k + 1) % 3], rows[(k + 2) % 3]
        minor = product_of(u[0], v[1]) - product_of(u[1], v[0])
        total += product_of(minor, rows[k, 2])
    return total[:11]


@njit(cache=True, error_model="numpy")
def _null_vector(rows: FloatArray, z: float) -> tuple[float, float, float]:
    """Return (x, y, 1) up to scale at a root z: the largest of the rows' cross products."""
    A = np.empty((3, 3))
    for k in range(3):
        for part in range(3):
            A[k, part] = value_at(rows[k, part], z)
    best, size = (0.0, 0.0, 1.0), 0.0
    for k in range(3):
        u, v = A[k], A[(k + 1) % 3]
        cross = (
            u[1] * v[2] - u[2] * v[1],
            u[2] * v[0] - u[0] * v[2],
            u[0] * v[1] - u[1] * v[0],
        )
        length = cross[0] ** 2 + cross[1] ** 2 + cross[2] ** 2
        if length > size:
            best, size = cross, length
    return best
