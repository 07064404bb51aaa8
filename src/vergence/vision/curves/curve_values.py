"""The numbers of a curve in one image, such as centre, semi-axes and angle, with covariance."""

from typing import NamedTuple

import numpy as np

from vergence.arrays import FloatArray
from vergence.features import moments_of_polygon
from vergence.geometry import EllipseShape
from vergence.vision.curves.rings import signed_area

HALF_TURN_UNKNOWN_RAD = float(np.pi / np.sqrt(12.0))  # deviation of an unknown axis angle


class CurveValues(NamedTuple):
    """Parameters that describe a curve in one image, with their covariance."""

    values: FloatArray  # (P,)
    covariance: FloatArray  # (P, P)

    @property
    def deviations(self) -> FloatArray:
        """Standard deviation of each, (P,)."""
        deviations: FloatArray = np.sqrt(np.diag(self.covariance))
        return deviations


def ellipse_values(shape: EllipseShape, covariance: FloatArray) -> CurveValues:
    """Return centre u, v, semi-axes a ≥ b (px) and the angle of the longer one (rad), (5,).

    The semi-axes are the eigenvalues of S = `EllipseShape.root`, with eigenvectors e₁ and e₂, so
    that da = e₁ᵀ dS e₁, db = e₂ᵀ dS e₂ and dα = e₁ᵀ dS e₂ / (a - b). The angle lies within
    (-π/2, π/2], from x to y; that of a circle is unknown.

    Args:
        shape: the ellipse, px.
        covariance: of its centre and S11, S12, S22, (5, 5), px².
    """
    (b, a), axes = np.linalg.eigh(shape.root)
    c, s = axes[:, 1]
    J = np.zeros((5, 5))
    J[:2, :2] = np.eye(2)
    J[2, 2:] = c * c, 2.0 * c * s, s * s
    J[3, 2:] = s * s, -2.0 * c * s, c * c
    J[4, 2:] = np.array([-c * s, c * c - s * s, c * s]) / max(a - b, 1e-9)
    values = np.array([*shape.centre, a, b, _within_half_turn(np.arctan2(s, c))])
    return _with_angle(values, J @ covariance @ J.T)


def line_values(foot: FloatArray, along: FloatArray, covariance: FloatArray) -> CurveValues:
    """Return ρ (px) and θ (rad) of the line x cos θ + y sin θ = ρ in pixel coordinates, (2,).

    θ is the direction of the normal n to the left of the line's direction, as seen in the image,
    like that of the feature `lines`. With the offset d at the foot and the slope m along it, n
    becomes n - m t, where t is the line's direction: dθ = -dm and dρ = dd - (t · foot) dm.

    Args:
        foot: a point of the line, (2,), px.
        along: its direction t, (2,).
        covariance: of d and m, (2, 2), px and 1.
    """
    normal = np.array([along[1], -along[0]])
    J = np.array([[1.0, -(along @ foot)], [0.0, -1.0]])
    values = np.array([normal @ foot, np.arctan2(normal[1], normal[0])])
    return CurveValues(values, J @ covariance @ J.T)


def region_values(points: FloatArray, covariance: FloatArray) -> CurveValues:
    """Return area (px²), centre u, v (px) and the direction of the longest extent (rad), (4,).

    A corner p of the outline that moves by δ changes the integral of f over the interior by f(p)
    n·δ, where n is half the vector between its neighbours, turned outwards. The direction lies
    within (-π/2, π/2], from x to y; without a longest extent it is unknown.

    Args:
        points: corners of the region as one polygon, see `joined_rings`, (M, 2), px.
        covariance: of each, (M, 2, 2), px².
    """
    moments = moments_of_polygon("region", points)
    along_x, along_y = 0.5 * (np.roll(points, -1, axis=0) - np.roll(points, 1, axis=0)).T
    outwards = np.sign(signed_area(points)) * np.column_stack((along_y, -along_x))
    (x, y), mu = (points - moments.centre).T, moments.mu
    across, along = 2.0 * mu[1, 1], mu[2, 0] - mu[0, 2]
    double = np.arctan2(across, along)
    unlike = max(np.hypot(across, along), 1e-9 * (mu[2, 0] + mu[0, 2]))
    turn = (np.cos(double) * x * y - 0.5 * np.sin(double) * (x * x - y * y)) / unlike
    factors = np.stack((np.ones(len(x)), x / moments.size, y / moments.size, turn))
    J = factors[:, :, None] * outwards  # (4, M, 2)
    total = np.einsum("imc,mcd,jmd->ij", J, covariance, J)
    values = np.array([moments.size, *moments.centre, 0.5 * double])
    return _with_angle(values, total)


def _within_half_turn(angle: float) -> float:
    """Return an angle of an axis within (-π/2, π/2]."""
    return float(0.5 * np.pi - (0.5 * np.pi - angle) % np.pi)


def _with_angle(values: FloatArray, covariance: FloatArray) -> CurveValues:
    """Return numbers whose last is the angle of an axis, which is known to half a turn at worst."""
    if not covariance[-1, -1] < HALF_TURN_UNKNOWN_RAD**2:
        covariance[-1], covariance[:, -1] = 0.0, 0.0
        covariance[-1, -1] = HALF_TURN_UNKNOWN_RAD**2
    return CurveValues(values, covariance)
