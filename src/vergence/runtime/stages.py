"""The stages of the loop that users may replace, as the loop sees them."""

from collections.abc import Iterable
from typing import NamedTuple, Protocol, runtime_checkable

from vergence.arrays import FloatArray
from vergence.control import Law
from vergence.runtime.arrival import Goal
from vergence.runtime.task_ends import Until
from vergence.runtime.timeouts import Timeouts
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
class Tells(Protocol):
    """A planner that reports events."""

    def events(self) -> Iterable[tuple[float, str, str]]:
        """Return what happened since the last call: time in s, name, and a sentence."""
        ...


@runtime_checkable
class PlansAgain(Protocol):
    """A planner that finds another way where the arm stalls."""

    def stalled(self, time: float, points_px: FloatArray, q: FloatArray) -> None:
        """Hear that the arm is at rest away from its goal.

        Args:
            time: s.
            points_px: where the features are, (M, 2).
            q: where the joints are, (n,).
        """
        ...

    @property
    def added_s(self) -> float:
        """By how much the task takes longer for it, s."""
        ...


@runtime_checkable
class EndsTask(Tells, Protocol):
    """A planner that knows when its task is done."""

    def conclusion(self, time: float) -> Outcome | None:
        """Return how the task ends, once it does."""
        ...

    def unfinished(self, time: float) -> Outcome:
        """Return how the task ends if its time is over."""
        ...


class Stages(NamedTuple):
    """What one task is done by."""

    perception: Perception  # looks at the images
    planner: Planner  # says what is desired
    law: Law  # says how to get there
    timeouts: Timeouts = Timeouts()
    goal: Goal | None = None  # when it counts as reached, and whether it ends there
    until: Until | None = None  # ends it as well
    duration_s: float = float("inf")  # after which its time is over
