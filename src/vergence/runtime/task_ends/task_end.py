"""What ends a task, as the loop sees it."""

from collections.abc import Callable
from typing import NamedTuple, Protocol

from vergence.arrays import FloatArray
from vergence.robot import Arm
from vergence.signals import Observation, Outcome, Reference


class EndSetting(NamedTuple):
    """What the end of a task may know of its cell."""

    arm: Arm  # that moves
    # From its joint positions (n,) to the pose (4, 4) of the task's camera in the world.
    camera_pose: Callable[[FloatArray], FloatArray]


class Moment(NamedTuple):
    """One image of a task."""

    time: float  # s since the start of the run
    since_s: float  # since the task began
    joints: FloatArray  # (n,) measured, rad or m
    observation: Observation  # what the image shows
    reference: Reference  # what was desired


def looks_for_target(end: object) -> bool:
    """Return whether an end needs the target to be searched for, even by a task that needs none."""
    return bool(getattr(end, "looks_for_target", False))


class Until(Protocol):
    """Watches one task."""

    def over(self, now: Moment) -> Outcome | None:
        """Return how the task ends, once it does."""
        ...


class TaskEnd(Protocol):
    """A part that a task may name as its `until`."""

    def bind(self, setting: EndSetting) -> Until:
        """Return what watches a task that is about to begin.

        Raises:
            InputError: if it does not fit the task's arm.
        """
        ...
