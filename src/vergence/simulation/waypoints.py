"""From rest to rest through way-points."""

import numpy as np

from vergence.arrays import FloatArray
from vergence.cell.schema import PoseMotion, Waypoints
from vergence.geometry import rpy_to_matrix, se3


def smooth_step(share: FloatArray) -> FloatArray:
    """Return 10 s³ - 15 s⁴ + 6 s⁵: from rest to rest with the least jerk, s from 0 to 1."""
    s = np.clip(share, 0.0, 1.0)
    result: FloatArray = s**3 * (10.0 + s * (6.0 * s - 15.0))
    return result


def through_waypoints(motion: Waypoints, values: FloatArray, times: FloatArray) -> FloatArray:
    """Return the way through values (W, …) of the way-points at times (K,): (K, …)."""
    knots = np.array(motion.times_s) / motion.speed
    leg = np.clip(np.searchsorted(knots, times, side="right") - 1, 0, len(knots) - 2)
    share = smooth_step((times - knots[leg]) / (knots[leg + 1] - knots[leg]))
    way: FloatArray = values[leg] + share[:, None] * (values[leg + 1] - values[leg])
    return way


def through_poses(motion: PoseMotion, T_start: FloatArray, times: FloatArray) -> FloatArray:
    """Return the poses (K, 4, 4) at times (K,) of a motion that starts at T_start (4, 4)."""
    roll_pitch_yaw = np.deg2rad(motion.rotations_rpy_deg)
    values = np.hstack((np.array(motion.positions_m), roll_pitch_yaw[:, ::-1]))
    way = through_waypoints(motion, values, times)
    return np.array([T_start @ se3(rpy_to_matrix(row[3:]), row[:3]) for row in way])
