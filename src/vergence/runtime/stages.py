"""The stages of the loop that users may replace, as the loop sees them."""

from collections.abc import Iterable
from typing import Protocol, runtime_checkable

from vergence.signals import Frame, Observation, Outcome, Reference


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


@runtime_checkable
class EndsTask(Protocol):
    """A planner that knows when its task is done."""

    def conclusion(self, time: float) -> Outcome | None:
        """Return how the task ends, once it does."""
        ...

    def unfinished(self, time: float) -> Outcome:
        """Return how the task ends if its time is over."""
        ...

    def events(self) -> Iterable[tuple[float, str, str]]:
        """Return what happened since the last call: time in s, name, and a sentence."""
        ...
