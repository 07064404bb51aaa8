"""Looking ahead over a known latency."""

import numpy as np

from vergence.estimation.motion import predict_covariance, predict_pose
from vergence.signals import TargetState


def extrapolate(
    state: TargetState,
    time: float,
    acceleration_density: float = 0.01,
    angular_acceleration_density: float = 0.25,
) -> TargetState:
    """Return a target's state at another time, at constant velocity.

    For control: where the target is now, from an image that is some frames old.

    Args:
        state: as perception reported it.
        time: s; before the state's own, the covariance grows just as it does after it.
        acceleration_density: of the target's white acceleration, m²/s³.
        angular_acceleration_density: rad²/s³.
    """
    dt = time - state.time
    density = np.array([acceleration_density, angular_acceleration_density])
    return TargetState(
        time,
        predict_pose(state.T_world_target, state.velocity, dt),
        state.velocity,
        predict_covariance(state.covariance, state.velocity, abs(dt), density),
        state.consistent,
    )
