"""Whether a run of the batch kernel, which knows of no bodies, keeps clear of them."""

import numpy as np

from vergence.arrays import FloatArray, IntArray
from vergence.control import ClearBraking, guarded_step
from vergence.robot import Arm, Clearance
from vergence.signals import Setpoint


def stays_clear(
    clearance: Clearance,
    arm: Arm,
    dt: float,
    setpoints: Setpoint,
    rates: FloatArray,
    ticks: IntArray,
) -> bool:
    """Return whether the guard lets every set-point of a run pass, as it would in the loop.

    Args:
        clearance: what is to be kept apart.
        arm: with its limits.
        dt: inner period, s.
        setpoints: positions and rates at each image, (K, n) each.
        rates: that the law asked for from there on, (K, n).
        ticks: for how many inner periods, (K,).
    """
    braking = ClearBraking(arm, clearance, dt)
    q, velocity = setpoints.position, setpoints.velocity
    fastest = np.maximum(np.abs(rates), np.abs(velocity))
    # A joint outside its range is brought back at a rate of its own.
    fastest = np.where((q < arm.q_min) | (q > arm.q_max), arm.rate_max, fastest)
    fastest, limits = np.minimum(fastest, arm.rate_max), arm.limits
    seconds = np.asarray(ticks * dt, dtype=np.float64)
    k = 0
    while k < len(rates):
        clear = braking.clear_periods(q[k:], fastest[k:], seconds[k:])
        if clear == 0:
            step = q[k], velocity[k]
            for _ in range(ticks[k]):
                step = guarded_step(*step, rates[k], limits, dt)[:2]
                if braking.hindrance(Setpoint(*step)):
                    return False
        k += max(clear, 1)
    return True
