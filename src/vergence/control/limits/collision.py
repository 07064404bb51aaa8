"""Rows that keep an arm clear of itself and of what is around it, also while it brakes."""

import numpy as np

from vergence.arrays import FloatArray
from vergence.robot import NearPairs


def collision_rows(near: NearPairs, approach_rate: float) -> tuple[FloatArray, FloatArray]:
    """Return a row for each pair that is near, C (K, n) and d (K,).

    The barrier ḋ ≥ -γ (d - d_min) is the velocity damper of [Faverjon1987] with γ = ξ/(dᵢ - dₛ): it
    lets a pair near each other by at most the share γ of the room left in a second, and leads one
    that is too near apart again.

    Args:
        near: the pairs.
        approach_rate: γ, 1/s.
    """
    return near.gradient, -approach_rate * (near.distance - near.margin) - near.drift


def braking_rows(
    stopped: NearPairs,
    approach_rate: float,
    velocity: FloatArray,
    acceleration_max: FloatArray,
    period_s: float,
) -> tuple[FloatArray, FloatArray]:
    """Return a row for each pair that is near where the arm would stop.

    Joints whose motions keep a pair apart between them do not brake in the same time: one may stop
    while the other still closes the gap. With D the distance at `braked`, and g its gradient there,
    the barrier Ḋ ≥ -γ (D - d_min) is linear in the next rates q̇':

        Ḋ = Σ gᵢ (q̇ᵢ' + |q̇ᵢ| q̈ᵢ/aᵢ),  q̈ᵢ = (q̇ᵢ' - q̇ᵢ)/T

    Args:
        stopped: the pairs, with the joints at `braked`.
        approach_rate: γ, 1/s.
        velocity: joint rates now, (n,).
        acceleration_max: a, (n,).
        period_s: T, how long the next rates will act.

    Returns:
        C (K, n) and d (K,).
    """
    share = np.abs(velocity) / (acceleration_max * period_s)
    C, d = collision_rows(stopped, approach_rate)
    return C * (1.0 + share), d + C @ (share * velocity)


def braked(q: FloatArray, velocity: FloatArray, acceleration_max: FloatArray) -> FloatArray:
    """Return where each joint stops that brakes now, (n,)."""
    return q + 0.5 * velocity * np.abs(velocity) / acceleration_max
