"""The replaceable stages of the loop, as the loop uses them."""

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
        """Return the observation in the frames, or None if none of them is relevant."""
        ...


class Planner(Protocol):
    """Provides the desired features over time."""

    def reference(self, time: float) -> Reference:
        """Return the reference for the law.

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
    """A planner that finds another path when the arm stalls."""

    def stalled(self, time: float, points_px: FloatArray, q: FloatArray) -> None:
        """Receive the information that the arm is at rest away from its goal.

        Args:
            time: now, s.
            points_px: positions of the features, (M, 2).
            q: joint positions, (n,).
        """
        ...

    @property
    def added_s(self) -> float:
        """The additional time that the task takes because of it, s."""
        ...


@runtime_checkable
class EndsTask(Tells, Protocol):
    """A planner that determines when its task is done."""

    def conclusion(self, time: float) -> Outcome | None:
        """Return the outcome of the task once it has ended."""
        ...

    def unfinished(self, time: float) -> Outcome:
        """Return the outcome of the task if its time is over."""
        ...


class Stages(NamedTuple):
    """The parts that perform one task."""

    perception: Perception  # processes the images
    planner: Planner  # provides the desired features
    law: Law  # computes the command
    timeouts: Timeouts = Timeouts()
    goal: Goal | None = None  # when the task counts as reached, and whether it ends there
    until: Until | None = None  # an additional end of the task
    duration_s: float = float("inf")  # time after which the task is over
