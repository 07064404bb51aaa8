"""Rows that keep an arm clear of itself and of what is around it, also while it brakes."""

from collections.abc import Iterator

import numpy as np

from vergence.arrays import BoolArray, FloatArray
from vergence.robot import Clearance, NearPairs

_STOPS_HERE = 0.25  # of a pair's margin; smaller braking distances need no check
_ROUNDING = 1e-10  # by which the solver lets a row be violated


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


class CollisionLimit:
    """The limit on the distances between bodies: rows for pairs that are near, or would be.

    Args:
        clearance: computes the distances.
        approach_rate: γ, 1/s.
        acceleration_max: of the joints, (n,).
        period_s: time for which a command acts.
    """

    def __init__(
        self,
        clearance: Clearance,
        approach_rate: float,
        acceleration_max: FloatArray,
        period_s: float,
    ) -> None:
        self._clearance, self._rate = clearance, approach_rate
        self._acceleration_max, self._period_s = acceleration_max, period_s
        self.near, self.least = clearance.near, clearance.least

    def rows(
        self, near: NearPairs, q: FloatArray, velocity: FloatArray
    ) -> Iterator[tuple[FloatArray, FloatArray]]:
        """Yield the rows of pairs close now, and of those close where the arm would stop.

        Args:
            near: the pairs close now.
            q: joint positions, (n,).
            velocity: joint rates now, (n,).
        """
        yield collision_rows(near, self._rate)
        end = braked(q, velocity, self._acceleration_max)
        nearer = self._clearance.reach @ np.abs(end - q)
        if (nearer > _STOPS_HERE * self._clearance.margin).any():
            stopped, a = self._clearance.near(end), self._acceleration_max
            yield braking_rows(stopped, self._rate, velocity, a, self._period_s)

    def is_idle(self, q: FloatArray, velocity: FloatArray, rates: FloatArray) -> bool:
        """Return whether joint rates that were found without these rows satisfy them at every tick.

        They are then the ones found with them: the program is strictly convex.

        Args:
            q: joint positions at each tick, (K, n).
            velocity: joint rates there, (K, n).
            rates: those that follow, (K, n).
        """
        k = 0
        while k < len(q):
            sure = self._surely_idle(q[k:], velocity[k:], rates[k:])
            if not sure[0]:
                rows = self.rows(self._clearance.near(q[k]), q[k], velocity[k])
                if any((C @ rates[k] < d - _ROUNDING).any() for C, d in rows):
                    return False
            k += max(1, int(np.argmin(sure))) if not sure.all() else len(sure)
        return True

    def _surely_idle(self, q: FloatArray, velocity: FloatArray, rates: FloatArray) -> BoolArray:
        """Return at which ticks no joint can bring a pair so near, by distances at the first."""
        a, reach = self._acceleration_max, self._clearance.reach.T
        share = np.abs(velocity) / (a * self._period_s)
        fastest = np.maximum(np.abs(rates), np.abs(rates + share * (rates - velocity)))
        moved = np.abs(q - q[0]) + np.abs(braked(q, velocity, a) - q)
        left = self._clearance.distances(q[0]) - moved @ reach - self._clearance.margin
        sure: BoolArray = (fastest @ reach <= self._rate * left).all(axis=1)
        return sure
