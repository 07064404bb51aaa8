"""Clamped cubic B-splines over [0, 1], as matrices from control points to samples."""

from typing import NamedTuple

import numpy as np

from vergence.arrays import FloatArray


class SplineBasis(NamedTuple):
    """Values and roughness of a spline with K control points at M samples."""

    values: FloatArray  # (M, K) samples = values @ control points; four entries a row
    first: FloatArray  # (M, K) first derivative with respect to the parameter
    roughness: FloatArray  # (K, K) ∫ |q'|² + smoothing ∫ |q''|² as a quadratic form


def spline_basis(controls: int, samples: int, smoothing: float = 0.0) -> SplineBasis:
    """Return the matrices of a clamped uniform cubic B-spline."""
    from scipy.interpolate import BSpline

    knots = np.concatenate((np.zeros(3), np.linspace(0, 1, controls - 2), np.ones(3)))
    spline = BSpline(knots, np.eye(controls), 3)
    at = np.linspace(0, 1, samples)
    nodes, weights = _gauss(controls - 3)
    first, second = spline(nodes, 1), spline(nodes, 2)
    roughness = first.T @ (weights[:, None] * first)
    roughness += smoothing * second.T @ (weights[:, None] * second)
    return SplineBasis(
        np.ascontiguousarray(spline(at)), np.ascontiguousarray(spline(at, 1)), roughness
    )


def _gauss(spans: int) -> tuple[FloatArray, FloatArray]:
    """Return nodes and weights that integrate quartics exactly over each span of [0, 1]."""
    node, weight = np.polynomial.legendre.leggauss(3)
    starts = np.arange(spans)[:, None] / spans
    nodes = starts + (node + 1) / (2 * spans)
    return nodes.ravel(), np.tile(weight / (2 * spans), spans)


def fit_controls(basis: SplineBasis, waypoints: FloatArray, scale: FloatArray) -> FloatArray:
    """Return control points (K, n) of the spline closest to waypoints (P, n), exact at the ends.

    Args:
        basis: of the spline.
        waypoints: one if the arm stays where it is, or more.
        scale: length of a unit of each joint, (n,), for the distance between waypoints.
    """
    lengths = np.linalg.norm(np.diff(waypoints, axis=0) * scale, axis=1)
    at = np.concatenate(([0.0], np.cumsum(lengths + 1e-9)))
    samples = np.linspace(0.0, at[-1], len(basis.values))
    desired = np.column_stack([np.interp(samples, at, column) for column in waypoints.T])
    ends = waypoints[[0, -1]]
    rest = desired - basis.values[:, [0, -1]] @ ends
    inner = basis.values[:, 1:-1]
    regular = inner.T @ inner + 1e-6 * np.eye(inner.shape[1])
    controls = np.linalg.solve(regular, inner.T @ rest)
    return np.vstack((ends[:1], controls, ends[1:]))
