"""The vanishing point of parallel lines."""

import numpy as np

from vergence.arrays import FloatArray
from vergence.errors import InputError
from vergence.features._pairs import ends
from vergence.features.feature import Feature
from vergence.features.interaction import skew_matrices
from vergence.parts import as_part

_ROUND = 1e-9  # rad; planes through the camera and a line that differ by less are one


@as_part("feature", "vanishing_point")
class VanishingPoint(Feature):
    """Vanishing point of two parallel lines, as a unit vector along the ray to it.

    Takes four points: two on the first line, two on the second, in the same direction. It changes
    only with camera rotation, and is defined even where the images of the lines are parallel.
    """

    def value(self) -> FloatArray:
        """Return the unit vector, (3,), in the direction from first to second points."""
        if len(self.points) != 4:
            given = f"{len(self.points)} points"
            raise InputError("vanishing_point", "points", given, "four: two on each of two lines")
        first, second = ends("vanishing_point", self.points)
        ones = np.ones((2, 1))
        planes = np.cross(np.hstack((first, ones)), np.hstack((second, ones)))
        ray = np.cross(*planes)
        length = np.linalg.norm(ray)
        if not length > _ROUND * np.prod(np.linalg.norm(planes, axis=1)):
            raise InputError("vanishing_point", "points", "one line twice", "two lines")
        # Seen from each of the four points, it lies ahead on both lines or behind on both.
        ahead = [
            np.sum((second - first) * (ray[:2] - ray[2] * end), axis=1) for end in (first, second)
        ]
        towards = np.sign(ahead)
        if abs(towards.sum()) != towards.size:
            given = "lines in opposite directions, or that cross between their points"
            allowed = "parallel lines in the same direction"
            raise InputError("vanishing_point", "points", given, allowed)
        unit: FloatArray = ray / (towards[0, 0] * length)
        return unit

    def interaction(self) -> FloatArray:
        """Return L (3, 6) by u̇ = -ω × u, at whatever depth the lines are."""
        return np.hstack((np.zeros((3, 3)), skew_matrices(self.value()[None])[0]))
