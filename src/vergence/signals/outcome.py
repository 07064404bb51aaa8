"""How a run ends: failure is a result with a name, a reason and a time."""

from dataclasses import dataclass
from enum import StrEnum
from typing import NamedTuple


class OutcomeKind(StrEnum):
    """The names of the ways a run can end."""

    COMPLETED = "completed"  # a task without an end, whose time is over
    REACHED = "reached"  # a task with an end, at its goal
    NOT_REACHED = "not reached"  # at rest away from the goal, or out of time
    TARGET_LOST = "target lost"
    JOINT_LIMIT = "joint limit"
    COLLISION = "collision"  # braked before bodies touched
    SINGULARITY = "singularity"
    IMAGE_LATE = "image late"
    CAMERA_FROZEN = "camera frozen"
    BAD_SAMPLE = "bad sample"
    BAD_COMMAND = "bad command"
    CLOCK_ERROR = "clock error"
    NOT_FOLLOWING = "not following"
    PROTECTIVE_STOP = "protective stop"
    DRIVER_SILENT = "driver silent"
    PART_RAISED = "part raised"
    INFEASIBLE = "infeasible"
    STOPPED = "stopped"
    CUT_OFF = "cut off"  # a recording that ends before its run did


@dataclass(frozen=True, slots=True)
class Outcome:
    """The end of a run."""

    kind: OutcomeKind
    reason: str  # one sentence for a person: what happened, to what
    time: float  # s since the start of the run
    # How each task of several ended that was begun; the last as the run did. Empty for one task.
    tasks: tuple["TaskOutcome", ...] = ()

    @property
    def succeeded(self) -> bool:
        """Whether the task was done to its end."""
        return self.kind in (OutcomeKind.COMPLETED, OutcomeKind.REACHED)

    def __str__(self) -> str:
        """Kind, time and reason on one line."""
        return f"{self.kind.value} at {self.time:.2f} s: {self.reason}"


class TaskOutcome(NamedTuple):
    """How one of several tasks ended."""

    name: str  # of the task
    begun: float  # s since the start of the run
    outcome: Outcome
