"""The state of the filter of [Lippiello2005]."""

from dataclasses import dataclass, field

import numpy as np
from numba import njit

from vergence.arrays import FloatArray
from vergence.estimation.filters.consistency import Consistency
from vergence.geometry import rpy_rates_to_omega, rpy_to_matrix, se3


@njit(cache=True)
def twist_jacobian(w: FloatArray) -> FloatArray:
    """Return ∂(δp, δθ, δv, δω)/∂w, (12, 12), of w = (o, φ, ϑ, ψ, rates).

    δθ = T_o δ(φ, ϑ, ψ), and ω = T_o(φ, ϑ, ψ) d(φ, ϑ, ψ)/dt, eq. (17b), depends on both.
    """
    cos_phi, sin_phi = np.cos(w[3]), np.sin(w[3])
    cos_theta, sin_theta = np.cos(w[4]), np.sin(w[4])
    theta_rate, psi_rate = w[10], w[11]
    To = rpy_rates_to_omega(w[3:6])
    G = np.eye(12)
    G[3:6, 3:6] = To
    G[9:12, 9:12] = To
    G[9, 3] = -cos_phi * theta_rate - sin_phi * cos_theta * psi_rate
    G[10, 3] = -sin_phi * theta_rate + cos_phi * cos_theta * psi_rate
    G[9, 4] = -cos_phi * sin_theta * psi_rate
    G[10, 4] = -sin_phi * sin_theta * psi_rate
    G[11, 4] = -cos_theta * psi_rate
    return G


@dataclass(frozen=True, slots=True)
class RpyBelief:
    """State w = (o, φ, ϑ, ψ, rates) and its covariance at one time; immutable."""

    time: float  # s
    vector: FloatArray  # (12,) w: m, rad, m/s, rad/s
    vector_covariance: FloatArray  # (12, 12)
    consistency: Consistency = field(default_factory=Consistency)
    seen: float = -np.inf  # s, exposure of the last image that was used
    doubts: int = 0  # consecutive images of which no point could be used
    disagreeing: float = 0.0  # fading fraction of recent points that could not be used

    @property
    def T_world_target(self) -> FloatArray:
        """The pose, (4, 4)."""
        pose: FloatArray = se3(rpy_to_matrix(self.vector[3:6]), self.vector[:3])
        return pose

    @property
    def velocity(self) -> FloatArray:
        """The twist (v, ω) of the target's origin along world axes, (6,)."""
        omega = rpy_rates_to_omega(self.vector[3:6]) @ self.vector[9:]
        return np.concatenate((self.vector[6:9], omega))

    @property
    def covariance(self) -> FloatArray:
        """Covariance of (δp, δθ, δv, δω), world axes, (12, 12)."""
        G = twist_jacobian(self.vector)
        mapped: FloatArray = G @ self.vector_covariance @ G.T
        return mapped

    @property
    def honest_covariance(self) -> FloatArray:
        """The covariance, (12, 12), inflated while the innovations show that it is too small."""
        return self.covariance * self.consistency.scale
