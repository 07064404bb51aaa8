"""Image points in polar coordinates."""

import numpy as np

from vergence.arrays import FloatArray
from vergence.errors import InputError
from vergence.features._angles import wrapped
from vergence.features.feature import Feature
from vergence.parts import as_part

_AT_CENTRE = 1e-9  # normalized; far below a pixel


@as_part("feature", "polar_points")
class PolarPoints(Feature):
    """Distance ρ and direction θ of each point: s = (ρ1, θ1, ρ2, θ2, …).

    Rotation about the optical axis changes θ alone, so a large one does not drive the camera
    backwards as it does with Cartesian coordinates. θ is undefined at the image centre.
    """

    def value(self) -> FloatArray:
        """Return ρ and θ in turn, (2M,), rad."""
        x, y = self.points.T
        return np.column_stack((self._rho(), np.arctan2(y, x))).ravel()

    def interaction(self) -> FloatArray:
        """Return L (2M, 6): the rows of the points, along and across the ray from the centre."""
        L, rho = self.flows(), self._rho()
        c, s = self.points.T / rho
        along = c[:, None] * L[:, 0] + s[:, None] * L[:, 1]
        across = (c[:, None] * L[:, 1] - s[:, None] * L[:, 0]) / rho[:, None]
        return np.stack((along, across), axis=1).reshape(-1, 6)

    def error(self, desired: "PolarPoints") -> FloatArray:
        """Return e = s - s_star, (2M,), with differences of θ within half a turn."""
        difference = super().error(desired)
        difference[1::2] = wrapped(difference[1::2])
        return difference

    def _rho(self) -> FloatArray:
        rho: FloatArray = np.hypot(*self.points.T)
        if not (rho > _AT_CENTRE).all():
            raise InputError("polar_points", "points", "one at the image centre", "points off it")
        return rho
