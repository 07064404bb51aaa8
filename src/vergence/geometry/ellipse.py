"""Ellipses in a plane: fitting one to points, and sampling points on one."""

from typing import NamedTuple

import numpy as np

from vergence.arrays import FloatArray


class EllipseShape(NamedTuple):
    """An ellipse, represented by the moments of its interior.

    Attributes:
        centre: (2,).
        second: normalised second central moments [[n20, n11], [n11, n02]], (2, 2). Their
            eigenvalues are a quarter of the squared semi-axes.
    """

    centre: FloatArray
    second: FloatArray

    @property
    def root(self) -> FloatArray:
        """The symmetric S (2, 2) for which the centre plus S u is on the ellipse if |u| = 1."""
        values, axes = np.linalg.eigh(4.0 * self.second)
        root: FloatArray = (axes * np.sqrt(np.maximum(values, 0.0))) @ axes.T
        return root

    @property
    def semi_axes(self) -> tuple[float, float]:
        """The semi-major and the semi-minor axis."""
        small, large = np.sqrt(np.maximum(np.linalg.eigvalsh(4.0 * self.second), 0.0)).tolist()
        return large, small

    def points(self, count: int) -> FloatArray:
        """Return points on it, (count, 2), that vary smoothly with it, even near a circle.

        They are the centre plus S u for unit vectors u at equally spaced angles.
        """
        return self.centre + unit_vectors(count) @ self.root


def unit_vectors(count: int) -> FloatArray:
    """Return unit vectors at equally spaced angles, (count, 2), the first along x."""
    angle = 2.0 * np.pi * np.arange(count) / count
    return np.column_stack((np.cos(angle), np.sin(angle)))


def ellipse_through(points: FloatArray) -> EllipseShape | None:
    """Return the ellipse that best fits points (M, 2), None if the best conic is not an ellipse.

    Fits the conic pᵀ M p + bᵀ p = 1, with p relative to the mean of the points, by linear least
    squares; exact if the points lie on an ellipse.
    """
    if len(points) < 5:
        return None
    about = points.mean(axis=0)
    scale = float(np.abs(points - about).max())
    if not scale > 0.0:
        return None
    x, y = (points - about).T / scale
    terms = np.column_stack((x * x, 2.0 * x * y, y * y, x, y))
    (a, b, c, d, e), _, rank, _ = np.linalg.lstsq(terms, np.ones(len(x)), rcond=1e-10)
    M = np.array([[a, b], [b, c]])
    if rank < 5 or a + c <= 0.0 or np.linalg.det(M) <= 1e-12 * (a + c) ** 2:
        return None
    centre = np.linalg.solve(M, [-0.5 * d, -0.5 * e])
    size = 1.0 + centre @ M @ centre
    return EllipseShape(about + scale * centre, scale**2 * size / 4.0 * np.linalg.inv(M))
