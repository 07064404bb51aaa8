"""A moving pose, and its extrapolation."""

from typing import NamedTuple

from numba import njit

from vergence.arrays import FloatArray
from vergence.geometry import moved_pose


class MovingPose(NamedTuple):
    """A pose and its velocity, both along world axes."""

    T: FloatArray  # (4, 4) in the world
    twist: FloatArray  # (6,) velocity of its origin and angular velocity, m/s and rad/s


@njit(cache=True)
def moved(pose: MovingPose, dt: float) -> FloatArray:
    """Return the pose (4, 4) after dt seconds at its present velocity."""
    return moved_pose(pose.T, dt * pose.twist)
