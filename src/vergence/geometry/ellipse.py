"""Ellipses in a plane: from points on them, and points on them."""

from typing import NamedTuple

import numpy as np

from vergence.arrays import FloatArray


class EllipseShape(NamedTuple):
    """An ellipse, by the moments of its inside.

    Attributes:
        centre: (2,).
        second: normalised second central moments [[n20, n11], [n11, n02]], (2, 2): a quarter of
            the squared semi-axes along its axes.
    """

    centre: FloatArray
    second: FloatArray

    @property
    def root(self) -> FloatArray:
        """The symmetric S with S u on the ellipse, less its centre, for every unit vector u."""
        values, axes = np.linalg.eigh(4.0 * self.second)
        root: FloatArray = (axes * np.sqrt(np.maximum(values, 0.0))) @ axes.T
        return root

    @property
    def semi_axes(self) -> tuple[float, float]:
        """The longer and the shorter one."""
        small, large = np.sqrt(np.maximum(np.linalg.eigvalsh(4.0 * self.second), 0.0)).tolist()
        return large, small

    def points(self, count: int) -> FloatArray:
        """Return points on it, (count, 2), that change smoothly with it, also where it is round.

        They are the centre plus S u for unit vectors u at equal angles.
        """
        return self.centre + unit_vectors(count) @ self.root


def unit_vectors(count: int) -> FloatArray:
    """Return unit vectors at equal angles, (count, 2), the first along x."""
    angle = 2.0 * np.pi * np.arange(count) / count
    return np.column_stack((np.cos(angle), np.sin(angle)))


def ellipse_through(points: FloatArray) -> EllipseShape | None:
    """Return the ellipse that fits points (M, 2) best, None if no ellipse does.

    The conic about the points' mean whose equation pᵀ M p + bᵀ p = 1 they fulfil with the least
    squares; for points on an ellipse it is that one.
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
