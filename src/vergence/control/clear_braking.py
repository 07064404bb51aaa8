"""Whether an arm can still brake before its bodies touch anything."""

import numpy as np
from numba import njit

from vergence.arrays import BoolArray, FloatArray
from vergence.robot import Arm, Clearance
from vergence.signals import Setpoint

SHARE = 0.5  # of the margin that the law keeps; what is left is for its servos


class ClearBraking:
    """Checks the path on which an arm brakes from a set-point.

    A pair of bodies that is d₀ and d₁ apart at two points of the path stays apart in between if
    d₀ + d₁ exceeds what the joints can change its distance by, Σ reachᵢ |Δqᵢ|: else the path is
    halved. If every set-point is passed by this check before it is commanded, braking from any of
    them keeps stationary things apart, and so do the set-points.

    Args:
        arm: with its limits.
        clearance: distances between the bodies.
        period_s: of the set-points.
    """

    def __init__(self, arm: Arm, clearance: Clearance, period_s: float) -> None:
        self._arm, self._clearance, self._period_s = arm, clearance, period_s
        self._kept = SHARE * clearance.margin
        self._q: FloatArray | None = None  # where the distances are known, (n,)
        self._room = np.empty(0)  # (P,) m, beyond what is kept there
        self._others = np.empty(0)  # where the other arms' joints were then, (k,)

    def hindrance(self, setpoint: Setpoint) -> str:
        """Return which bodies would come how near if the arm braked from here; else nothing."""
        q, a = setpoint.position, self._arm.acceleration_max
        most = setpoint.velocity**2 / (2.0 * a)
        if self._known_clear(q, most):
            return ""
        self._q, self._room, self._others = q, self._rooms(q), self._clearance.others()
        if self._known_clear(q, most):
            return ""
        pairs = self._clearance.reach @ most >= self._room
        last = int(np.ceil((np.abs(setpoint.velocity) / (a * self._period_s)).max()))
        start, end = self._room[pairs], self._rooms(self._braked(setpoint, last))[pairs]
        return self._between(setpoint, pairs, (0, start), (last, end))

    def stays_clear(self, q: FloatArray, fastest: FloatArray, seconds: float) -> bool:
        """Return whether nothing can hinder set-points that start at q, for sure.

        Args:
            q: joint positions, (n,).
            fastest: what no rate exceeds, (n,).
            seconds: for which they move.
        """
        most = fastest * seconds + fastest**2 / (2.0 * self._arm.acceleration_max)
        if self._known_clear(q, most):
            return True
        self._q, self._room, self._others = q, self._rooms(q), self._clearance.others()
        return self._known_clear(q, most)

    def clear_periods(self, q: FloatArray, fastest: FloatArray, seconds: FloatArray) -> int:
        """Return in how many periods, from the first on, nothing can hinder set-points, for sure.

        Args:
            q: joint positions at the start of each, (K, n).
            fastest: what no rate exceeds in it, (K, n).
            seconds: how long it is, (K,).
        """
        most = fastest * seconds[:, None] + fastest**2 / (2.0 * self._arm.acceleration_max)
        changed = (np.abs(q - q[0]) + most) @ self._clearance.reach.T
        clear = (changed < self._rooms(q[0])).all(axis=1)
        return len(clear) if clear.all() else int(np.argmin(clear))

    def _known_clear(self, q: FloatArray, most: FloatArray) -> bool:
        """Return whether the distances known are large enough for all that the joints may move."""
        if self._q is None:
            return False
        room = self._room
        if len(self._others):
            moved = np.abs(self._clearance.others() - self._others)
            room = room - self._clearance.reach_of_others @ moved
        return bool(_changes_less(self._clearance.reach, self._q, q, most, room))

    def _rooms(self, q: FloatArray) -> FloatArray:
        rooms: FloatArray = self._clearance.distances(q) - self._kept
        return rooms

    def _braked(self, setpoint: Setpoint, steps: int) -> FloatArray:
        """Return the set-point after so many steps of braking, (n,), as `guarded_step` makes it.

        A joint that loses a dt of its speed with each of k steps moves by k (|v| - a dt (k + 1)/2)
        dt in these.
        """
        speed, lost = np.abs(setpoint.velocity), self._arm.acceleration_max * self._period_s
        k = np.minimum(steps, np.floor(speed / lost))
        moved = k * (speed - 0.5 * lost * (k + 1.0)) * self._period_s
        q: FloatArray = setpoint.position + np.copysign(moved, setpoint.velocity)
        return q

    def _between(
        self,
        setpoint: Setpoint,
        pairs: BoolArray,
        start: tuple[int, FloatArray],
        end: tuple[int, FloatArray],
    ) -> str:
        """Return which of the pairs would come too near between two steps with their rooms."""
        least = np.minimum(start[1], end[1])
        if (least <= 0.0).any():
            pair = int(np.flatnonzero(pairs)[least.argmin()])
            return f"{self._clearance.name(pair)} would come within {1e3 * self._kept[pair]:.1f} mm"
        moved = np.abs(self._braked(setpoint, end[0]) - self._braked(setpoint, start[0]))
        far = self._clearance.reach[pairs] @ moved >= start[1] + end[1]
        step = (start[0] + end[0]) // 2
        if not far.any() or step == start[0]:
            return ""
        middle = step, self._rooms(self._braked(setpoint, step))[pairs]
        return self._between(setpoint, pairs, start, middle) or self._between(
            setpoint, pairs, middle, end
        )


@njit(cache=True, error_model="numpy")
def _changes_less(
    reach: FloatArray, q_from: FloatArray, q_to: FloatArray, most: FloatArray, room: FloatArray
) -> bool:
    """Return whether no pair's distance changes by its room (P,) between two positions, and on.

    Args:
        reach: what each joint changes each distance by at most, (P, n).
        q_from: joint positions, (n,).
        q_to: others, (n,).
        most: how far each joint moves on from there, (n,).
        room: (P,) m.
    """
    for p in range(len(room)):
        changed = 0.0
        for i in range(len(most)):
            changed += reach[p, i] * (abs(q_to[i] - q_from[i]) + most[i])
        if not changed < room[p]:
            return False
    return True
