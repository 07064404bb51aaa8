"""An ellipse: the image of a circle or of a sphere."""

import numpy as np

from vergence.arrays import FloatArray
from vergence.errors import InputError
from vergence.features.feature import Feature
from vergence.features.interaction import interaction_matrix_points
from vergence.features.plane import inverse_depth_plane
from vergence.geometry import EllipseShape, ellipse_through
from vergence.parts import as_part


@as_part("feature", "ellipse")
class Ellipse(Feature):
    """Centre and second moments of an ellipse: s = (x_g, y_g, n20, n11, n02) [Chaumette2004].

    The points may lie anywhere on the ellipse. Their depths are those of the circle's plane, or of
    the sphere's visible outline. For a sphere, L is exact as well: its outline moves over the
    sphere along lines of sight, which does not change the image.
    """

    of_curve = True

    def value(self) -> FloatArray:
        """Return s, (5,)."""
        (x, y), n = self._shape()
        return np.array([x, y, n[0, 0], n[0, 1], n[1, 1]])

    def interaction(self) -> FloatArray:
        """Return L (5, 6): that of [Chaumette2004] for ellipses, in matrix form.

        For points on a plane, every twist induces a quadratic image motion field. With G its
        gradient at the centre and p (cᵀ p) its quadratic part, the centre moves by the field there
        plus 4 n c, and n by G n + n Gᵀ; the third moments of an ellipse are zero.
        """
        centre, n = self._shape()
        plane = inverse_depth_plane(self.points, self.depth_m)
        near = plane[:2] @ centre + plane[2]
        if not near > 0.0:
            given = "depths by which the centre is behind the camera"
            raise InputError("ellipse", "depth_m", given, "depths of a circle in front of it")
        L = np.empty((5, 6))
        L[:2] = interaction_matrix_points(centre[None], np.array([1.0 / near]))
        for i, (G, c) in enumerate(_fields(centre, plane[:2], near)):
            L[:2, i] += 4.0 * n @ c
            change = G @ n + n @ G.T
            L[2:, i] = change[0, 0], change[0, 1], change[1, 1]
        return L

    def _shape(self) -> EllipseShape:
        shape = ellipse_through(self.points)
        if shape is None:
            given = f"{len(self.points)} points that no ellipse fits"
            raise InputError("ellipse", "points", given, "five or more points around an ellipse")
        return shape


def _fields(
    centre: FloatArray, slope: FloatArray, near: float
) -> tuple[tuple[FloatArray, FloatArray], ...]:
    """Return gradient G (2, 2) and quadratic part c (2,) of the motion field of each unit twist.

    Args:
        centre: (x, y), where the gradient is taken.
        slope: (A, B) of the plane 1/Z = A x + B y + C, 1/m.
        near: 1/Z of the plane at the centre, 1/m.
    """
    x, y = centre
    zero = np.zeros(2)
    gradients = (
        -np.outer([1.0, 0.0], slope),
        -np.outer([0.0, 1.0], slope),
        near * np.eye(2) + np.outer(centre, slope),
        np.array([[y, x], [0.0, 2.0 * y]]),
        np.array([[-2.0 * x, 0.0], [-y, -x]]),
        np.array([[0.0, 1.0], [-1.0, 0.0]]),
    )
    quadratic = (zero, zero, slope, np.array([0.0, 1.0]), np.array([-1.0, 0.0]), zero)
    return tuple(zip(gradients, quadratic, strict=True))
