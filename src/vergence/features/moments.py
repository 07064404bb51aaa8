"""Moments of a set of points, or of the interior of a polygon, as a feature of seven values."""

import numpy as np

from vergence.arrays import FloatArray
from vergence.features._angles import wrapped
from vergence.features._moment_rates import (
    MomentRates,
    elongation_rate,
    orientation_rate,
    rates_of_points,
    rates_of_polygon,
    tilt_rates,
)
from vergence.features._moments import (
    CentralMoments,
    elongation,
    moments_of_points,
    moments_of_polygon,
    orientation,
    require_same_points,
    tilt_invariants,
)
from vergence.features.feature import Feature
from vergence.parts import as_part

# Factor of ε. Its rate is about the tilt itself, so a law that believes a wrong depth gets even the
# sign wrong in a nearly frontal view; this little, ε does not outweigh s_x and s_y there.
_ELONGATION = 0.25


@as_part("feature", "moments")
class Moments(Feature):
    """Where points on a plane are, and how they are turned: s = (x_n, y_n, a_n, s_x, s_y, α, ε/4).

    The first six are the normalised set of [Tahri2005]. With a the sum of squared distances from
    the centre, a_n = 1/√a, and x_n, y_n are the centre times a_n: for a target parallel to the
    image plane, each changes with one of the camera's three translations. s_x and s_y change with
    rotations about the x and y axes, α with rotation about the optical axis. At another tilt all
    six can be those of the goal again, but the elongation ε [Hu1962] then differs. The points may
    be in any order.
    """

    def value(self) -> FloatArray:
        """Return s, (7,); α in rad, known up to half a turn."""
        moments = self._moments()
        a_n = 1.0 / np.sqrt(moments.size)
        turn = orientation(self._name, moments.mu)  # refuses extents that are alike
        tilt = tilt_invariants(moments)
        long = _ELONGATION * elongation(moments.mu)
        return np.array([*(moments.centre * a_n), a_n, *tilt, turn, long])

    def interaction(self) -> FloatArray:
        """Return L (7, 6): the derivatives of s as the points, or corners, move with the camera."""
        moments = self._moments()
        orientation(self._name, moments.mu)  # refuses extents that are alike
        rates = self._rates(moments)
        a_n, tilt = 1.0 / np.sqrt(moments.size), tilt_invariants(moments)
        L = np.empty((7, 6))
        L[2] = -0.5 * a_n / moments.size * rates.size
        L[:2] = a_n * rates.centre + np.outer(moments.centre, L[2])
        L[3:5] = tilt_rates(moments, tilt, rates)
        L[5] = orientation_rate(moments.mu, rates.mu)
        L[6] = _ELONGATION * elongation_rate(moments.mu, rates.mu)
        return L

    def error(self, desired: "Moments") -> FloatArray:
        """Return e = s - s_star, (7,), with the difference of α within a quarter turn."""
        if not self.of_curve:
            require_same_points(self._name, self.points, desired.points)
        difference = super().error(desired)
        difference[5:6] = wrapped(difference[5:6], np.pi)
        return difference

    _name = "moments"

    def _moments(self) -> CentralMoments:
        return moments_of_points(self._name, self.points)

    def _rates(self, moments: CentralMoments) -> MomentRates:
        return rates_of_points(self.points, self.flows(), moments)


@as_part("feature", "region_moments")
class RegionMoments(Moments):
    """`Moments` of the interior of a polygon; the points are its corners in order, a its area."""

    of_curve = True
    _name = "region_moments"

    def _moments(self) -> CentralMoments:
        return moments_of_polygon(self._name, self.points)

    def _rates(self, moments: CentralMoments) -> MomentRates:
        return rates_of_polygon(self.points, self.flows(), moments)
