"""Refinement of a motion on the essential manifold: five unknowns, no structure."""

import numpy as np
from numba import njit

from vergence.arrays import FloatArray
from vergence.geometry import skew, so3_exp
from vergence.vision.two_view.small import (
    apply,
    cholesky_solve,
    cross,
    dot,
    times,
    transposed_apply,
    transposed_times,
    unit,
)


@njit(cache=True)
def tangent_basis(direction: FloatArray) -> FloatArray:
    """Return two unit vectors orthogonal to a unit vector and to each other, (3, 2)."""
    axis = np.zeros(3)
    axis[np.argmin(np.abs(direction))] = 1.0
    basis = np.empty((3, 2))
    first = unit(cross(direction, axis))
    basis[:, 0] = first
    basis[:, 1] = cross(direction, first)
    return basis


@njit(cache=True)
def sampson_residuals(E: FloatArray, m_star: FloatArray, m: FloatArray) -> FloatArray:
    """Return the signed Sampson distance of each match from mᵀ E m* = 0, (N,)."""
    residuals = np.empty(len(m))
    for j in range(len(m)):
        a = np.array([m_star[j, 0], m_star[j, 1], 1.0])
        b = np.array([m[j, 0], m[j, 1], 1.0])
        line, line_star = apply(E, a), transposed_apply(E, b)
        spread = line[0] ** 2 + line[1] ** 2 + line_star[0] ** 2 + line_star[1] ** 2
        residuals[j] = dot(b, line) / np.sqrt(max(spread, 1e-300))
    return residuals


@njit(cache=True)
def sampson_gradient(E: FloatArray, m_star: FloatArray, m: FloatArray) -> FloatArray:
    """Return d(residuals)/dE, (N, 9), E row by row."""
    gradient = np.empty((len(m), 9))
    for j in range(len(m)):
        a = np.array([m_star[j, 0], m_star[j, 1], 1.0])
        b = np.array([m[j, 0], m[j, 1], 1.0])
        line, line_star = apply(E, a), transposed_apply(E, b)
        spread = line[0] ** 2 + line[1] ** 2 + line_star[0] ** 2 + line_star[1] ** 2
        root = np.sqrt(max(spread, 1e-300))
        pull = dot(b, line) / (root * root)
        line[2], line_star[2] = 0.0, 0.0
        for r in range(3):
            for c in range(3):
                change = line[r] * a[c] + b[r] * line_star[c]
                gradient[j, 3 * r + c] = (b[r] * a[c] - pull * change) / root
    return gradient


@njit(cache=True)
def essential_tangents(R: FloatArray, t: FloatArray) -> FloatArray:
    """Return dE/d(ω, τ), (9, 5), for R ← exp(ω) R and t ← t + B τ with B tangent to t."""
    basis, tangents = tangent_basis(t), np.empty((9, 5))
    for k in range(5):
        if k < 3:
            axis = np.zeros(3)
            axis[k] = 1.0
            change = times(skew(t), times(skew(axis), R))
        else:
            change = times(skew(basis[:, k - 3]), R)
        tangents[:, k] = change.ravel()
    return tangents


@njit(cache=True)
def sampson_jacobian(R: FloatArray, t: FloatArray, m_star: FloatArray, m: FloatArray) -> FloatArray:
    """Return d(residuals)/d(ω, τ), (N, 5)."""
    gradient = sampson_gradient(times(skew(t), R), m_star, m)
    return times(gradient, essential_tangents(R, t))


@njit(cache=True)
def refine_essential(
    R: FloatArray, t: FloatArray, m_star: FloatArray, m: FloatArray, iterations: int
) -> tuple[FloatArray, FloatArray, float]:
    """Minimise the sum of squared Sampson distances over R and the direction of t.

    Levenberg-Marquardt on SO(3) × S².

    Returns:
        R (3, 3), unit t (3,), and the sum of squares.
    """
    residuals = sampson_residuals(times(skew(t), R), m_star, m)
    cost, damping = dot(residuals, residuals), 1e-3
    for _ in range(iterations):
        J = sampson_jacobian(R, t, m_star, m)
        information = transposed_times(J, J)
        for k in range(5):
            information[k, k] += damping * information[k, k] + 1e-12
        gradient = transposed_apply(J, residuals).reshape(5, 1)
        step = -cholesky_solve(information, gradient)[:, 0]
        R_new = times(so3_exp(step[:3]), R)
        t_new = unit(t + apply(tangent_basis(t), step[3:]))
        residuals_new = sampson_residuals(times(skew(t_new), R_new), m_star, m)
        cost_new = dot(residuals_new, residuals_new)
        if cost_new < cost:
            gained = cost - cost_new
            R, t, residuals, cost = R_new, t_new, residuals_new, cost_new
            damping *= 0.2
            if gained < 1e-6 * cost + 1e-24:
                break
        else:
            damping *= 8.0
            if damping > 1e8:
                break
    return R, t, cost
