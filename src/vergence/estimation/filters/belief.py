"""The state of the pose filter."""

from dataclasses import dataclass, field

import numpy as np

from vergence.arrays import FloatArray
from vergence.estimation.filters.consistency import Consistency


@dataclass(frozen=True, slots=True)
class Belief:
    """Pose, velocity, and the covariance of their error, at one time; immutable.

    The error is (δp, δθ, δv, δω) along world axes: p + δp, exp(δθ) R, v + δv, ω + δω.
    """

    time: float  # s
    T_world_target: FloatArray  # (4, 4)
    velocity: FloatArray  # (6,) (v, ω) of the target's origin along world axes, m/s and rad/s
    covariance: FloatArray  # (12, 12)
    consistency: Consistency = field(default_factory=Consistency)
    seen: float = -np.inf  # s, exposure of the last image that was used
    doubts: int = 0  # consecutive images that contradicted the prediction and were not used
    disagreeing: float = 0.0  # fading fraction of recent points outside the gate

    @property
    def honest_covariance(self) -> FloatArray:
        """The covariance, (12, 12), inflated while the innovations show that it is too small."""
        return self.covariance * self.consistency.scale
