"""The protocol of conditions that end a task."""

from collections.abc import Callable
from typing import NamedTuple, Protocol

from vergence.arrays import FloatArray
from vergence.robot import Arm
from vergence.signals import Observation, Outcome, Reference


class EndSetting(NamedTuple):
    """What the end of a task may use of its cell."""

    arm: Arm  # the arm that moves
    # From its joint positions (n,) to the pose (4, 4) of the task's camera in the world.
    camera_pose: Callable[[FloatArray], FloatArray]


class Moment(NamedTuple):
    """One image of a task."""

    time: float  # s since the start of the run
    since_s: float  # since the task began
    joints: FloatArray  # (n,) measured, rad or m
    observation: Observation  # of the image
    reference: Reference  # for the image


def looks_for_target(end: object) -> bool:
    """Return whether an end requires searching for the target, even in a task that needs none."""
    return bool(getattr(end, "looks_for_target", False))


class Until(Protocol):
    """Monitors one task."""

    def over(self, now: Moment) -> Outcome | None:
        """Return the outcome of the task once it has ended."""
        ...


class TaskEnd(Protocol):
    """A part that a task may name as its `until`."""

    def bind(self, setting: EndSetting) -> Until:
        """Return the monitor of a task that is about to begin.

        Raises:
            InputError: if it does not suit the task's arm.
        """
        ...
