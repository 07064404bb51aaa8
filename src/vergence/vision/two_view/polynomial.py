"""Polynomials as coefficients in ascending powers: value, product, real roots."""

import numpy as np
from numba import njit

from vergence.arrays import FloatArray

_STEPS = 100  # largest number of steps to a root; Newton's method takes about six


@njit(cache=True, error_model="numpy")
def product_of(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return the product of two polynomials."""
    product = np.zeros(len(a) + len(b) - 1)
    for i in range(len(a)):
        for j in range(len(b)):
            product[i + j] += a[i] * b[j]
    return product


@njit(cache=True, error_model="numpy")
def value_at(p: FloatArray, x: float) -> float:
    """Return p(x), by Horner's method."""
    total = 0.0
    for i in range(len(p) - 1, -1, -1):
        total = total * x + p[i]
    return total


@njit(cache=True, error_model="numpy")
def real_roots(p: FloatArray) -> FloatArray:
    """Return the real roots of a polynomial with coefficients (n + 1,) in ascending powers.

    Roots beyond ±1 are found as inverse roots of the reversed polynomial. A double root may be
    missed.
    """
    far = roots_within_one(p[::-1].copy())
    return np.concatenate((roots_within_one(p), 1.0 / far[far != 0.0]))


@njit(cache=True, error_model="numpy")
def roots_within_one(p: FloatArray) -> FloatArray:
    """Return the real roots from -1 to 1 of a polynomial, as `real_roots` does.

    Between two neighbouring roots of its derivative a polynomial has one root or none, so the roots
    of each derivative are found from those of the next.
    """
    n = len(p) - 1
    q, roots = p.copy(), np.empty(0)
    for d in range(1, n + 1):  # the derivative of degree d, up to a factor
        for i in range(d + 1):
            q[i] = p[i + n - d]
            for k in range(n - d):
                q[i] *= (i + n - d - k) / (n - k)
        edges = np.empty(len(roots) + 2)
        edges[0], edges[1:-1], edges[-1] = -1.0, roots, 1.0
        roots, count = np.empty(d), 0
        for k in range(len(edges) - 1):
            rises = value_at(q[: d + 1], edges[k]) < 0.0
            if rises != (value_at(q[: d + 1], edges[k + 1]) < 0.0):
                roots[count] = _root_between(q[: d + 1], edges[k], edges[k + 1], rises)
                count += 1
        roots = roots[:count]
    return roots


@njit(cache=True, error_model="numpy")
def _root_between(p: FloatArray, low: float, high: float, rises: bool) -> float:
    """Return the root in an interval at whose ends the signs differ.

    By Newton's method; if a step leaves the interval or does not halve it, it is bisected.
    """
    x, before = 0.5 * (low + high), high - low
    for _ in range(_STEPS):
        value, slope = 0.0, 0.0
        for i in range(len(p) - 1, -1, -1):
            slope = slope * x + value
            value = value * x + p[i]
        if (value < 0.0) == rises:
            low = x
        else:
            high = x
        step = value / slope
        if low < x - step < high and abs(step) <= 0.5 * before:
            x -= step
        else:
            step, x = x - 0.5 * (low + high), 0.5 * (low + high)
        before = abs(step)
        if before <= 1e-15 * abs(x) or before < 1e-300:
            break
    return x
