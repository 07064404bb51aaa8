"""The stages of the loop that users may replace, as the loop sees them."""

from typing import Protocol

from vergence.signals import Frame, Observation, Reference


class Perception(Protocol):
    """Turns images into an observation."""

    def observe(self, frames: tuple[Frame, ...]) -> Observation | None:
        """Return what the frames show, or None if none of them concerns it."""
        ...


class Planner(Protocol):
    """Knows what is desired when."""

    def reference(self, time: float) -> Reference:
        """Return what the law should aim at.

        Args:
            time: exposure of the image that the law compares it with, s.
        """
        ...
