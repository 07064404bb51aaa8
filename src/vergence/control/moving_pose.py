"""A moving pose: extrapolation and comparison."""

from typing import NamedTuple

import numpy as np
from numba import njit

from vergence.arrays import FloatArray
from vergence.geometry import so3_exp, so3_log


class MovingPose(NamedTuple):
    """A pose and its velocity, both along world axes."""

    T: FloatArray  # (4, 4) in the world
    twist: FloatArray  # (6,) velocity of its origin and angular velocity, m/s and rad/s


@njit(cache=True)
def moved(pose: MovingPose, dt: float) -> FloatArray:
    """Return the pose (4, 4) after dt seconds at its present velocity."""
    T = np.eye(4)
    T[:3, :3] = so3_exp(pose.twist[3:] * dt) @ np.ascontiguousarray(pose.T[:3, :3])
    T[:3, 3] = pose.T[:3, 3] + pose.twist[:3] * dt
    return T


@njit(cache=True)
def pose_difference(T_to: FloatArray, T_from: FloatArray) -> FloatArray:
    """Return (Δp, Δθ), (6,), along world axes: p_to = p_from + Δp, R_to = exp(Δθ) R_from."""
    difference = np.empty(6)
    difference[:3] = T_to[:3, 3] - T_from[:3, 3]
    difference[3:] = so3_log(
        np.ascontiguousarray(T_to[:3, :3]) @ np.ascontiguousarray(T_from[:3, :3]).T
    )
    return difference
