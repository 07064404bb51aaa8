"""A trajectory of poses between two images at the inner rate, by a second-order filter."""

import numpy as np
from numba import njit

from vergence.control.moving_pose import MovingPose, moved
from vergence.geometry import pose_difference


@njit(cache=True)
def interpolate(
    reference: MovingPose, goal: MovingPose, frequency: float, damping: float, dt: float
) -> MovingPose:
    """Advance the filter by one inner period.

    a = ω² Δ(goal, reference) + 2 ζ ω (goal's twist - reference's twist): the second-order
    interpolating filter of [Lippiello2005] section IV. If the goal's twist is zero, as in the
    paper, it lags behind a moving goal by 2 ζ/ω seconds; with the true twist it does not.

    The discrete filter has the poles exp(s dt) of this one, and is stable as it is for every ω, ζ
    and period.

    Args:
        reference: the filter's state.
        goal: desired pose and its velocity.
        frequency: ω, rad/s.
        damping: ζ.
        dt: inner period, s.
    """
    decay, angle = damping * frequency * dt, frequency * dt * np.sqrt(abs(1.0 - damping * damping))
    product = np.exp(-2.0 * decay)  # of the two poles
    if damping < 1.0:
        total = 2.0 * np.exp(-decay) * np.cos(angle)
    else:
        total = np.exp(angle - decay) + np.exp(-angle - decay)
    pull = (1.0 + product - total) / dt * pose_difference(goal.T, reference.T)
    twist = reference.twist + pull + (1.0 - product) * (goal.twist - reference.twist)
    return MovingPose(moved(MovingPose(reference.T, twist), dt), twist)
