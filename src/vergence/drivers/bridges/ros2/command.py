"""The command to the arm, and how it decays to rest."""

from collections.abc import Sequence
from typing import NamedTuple


class Command(NamedTuple):
    """One set-point."""

    position: list[float]  # (n,) rad or m
    velocity: list[float]  # (n,) rad/s or m/s
    twist: list[float]  # (6,) m/s and rad/s of the end effector, in its own axes; may be empty

    @property
    def moving(self) -> bool:
        """Whether the arm is commanded to move."""
        return any(self.velocity)

    def seconds_to_rest(self, acceleration_max: Sequence[float]) -> float:
        """Return how long braking takes at the limits (n,) of the joints' accelerations."""
        pairs = zip(self.velocity, acceleration_max, strict=True)
        return max(abs(velocity) / acceleration for velocity, acceleration in pairs)

    def braked(self, after_s: float, whole_s: float) -> "Command":
        """Return the set-point so long after braking has begun.

        All joints come to rest at once, so the path stays the same: v(t) = (1 - t / T) v(0).

        Args:
            after_s: since braking began.
            whole_s: T, from `seconds_to_rest`.
        """
        t = min(after_s, whole_s)
        share = 1.0 - t / whole_s if whole_s > 0.0 else 0.0
        travelled = t - 0.5 * t * t / whole_s if whole_s > 0.0 else 0.0
        return Command(
            [q + travelled * v for q, v in zip(self.position, self.velocity, strict=True)],
            [share * v for v in self.velocity],
            [share * v for v in self.twist],
        )
