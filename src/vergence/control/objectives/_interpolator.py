"""A trajectory of poses between two images at the inner rate, by a second-order filter."""

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

    Args:
        reference: the filter's state.
        goal: desired pose and its velocity.
        frequency: ω, rad/s.
        damping: ζ.
        dt: inner period, s.
    """
    pull = frequency * frequency * pose_difference(goal.T, reference.T)
    twist = reference.twist + dt * (
        pull + 2.0 * damping * frequency * (goal.twist - reference.twist)
    )
    return MovingPose(moved(MovingPose(reference.T, twist), dt), twist)
