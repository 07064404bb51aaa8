"""Whether a run of the batch kernel, which knows of no bodies, keeps clear of them."""

from vergence.arrays import FloatArray, IntArray
from vergence.control import ClearBraking, Guard
from vergence.robot import Arm, Clearance


def stays_clear(
    clearance: Clearance,
    arm: Arm,
    start: FloatArray,
    dt: float,
    rates: FloatArray,
    ticks: IntArray,
) -> bool:
    """Return whether the guard lets every set-point of a run pass, as it would in the loop.

    Args:
        clearance: what is to be kept apart.
        arm: with its limits.
        start: joint positions, (n,).
        dt: inner period, s.
        rates: that the law asked for from each image on, (K, n).
        ticks: for how many inner periods, (K,).
    """
    guard = Guard(arm, start, dt, ClearBraking(arm, clearance, dt))
    for asked, count in zip(rates, ticks.tolist(), strict=True):
        if guard.steps(asked, count) is not None:
            continue
        for _ in range(count):
            guard.step(asked)
            if guard.hindrance:
                return False
    return True
