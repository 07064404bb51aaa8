"""Whether a run of the batch kernel, which knows of no bodies, may have touched any."""

import numpy as np

from vergence.arrays import FloatArray
from vergence.control.clear_braking import SHARE
from vergence.robot import Arm, Clearance


def stays_clear(clearance: Clearance, arm: Arm, position: FloatArray, period_s: float) -> bool:
    """Return whether the guard would have let every set-point pass, for sure.

    Between two images a joint that moved by Δq has no rate above |Δq|/T + q̈_max T. By what it may
    move at that, and then on braking, no distance changes by more than `Clearance.reach` says.

    Args:
        clearance: what is to be kept apart.
        arm: with its limits.
        position: joints at each image, (K, n).
        period_s: T, between two images.
    """
    a, kept = arm.acceleration_max, SHARE * clearance.margin
    moves = np.abs(np.diff(position, axis=0, append=position[-1:]))
    fastest = np.minimum(moves / period_s + a * period_s, arm.rate_max)
    ahead = fastest * period_s + fastest**2 / (2.0 * a)
    q, room = None, np.empty(0)
    for k in range(len(position)):
        if q is None or (clearance.reach @ (np.abs(position[k] - q) + ahead[k]) >= room).any():
            q, room = position[k], clearance.distances(position[k]) - kept
            if (clearance.reach @ ahead[k] >= room).any():
                return False
    return True
