"""The reason why planning failed."""

from dataclasses import dataclass
from enum import StrEnum

from vergence.signals import Outcome, OutcomeKind


class Obstacle(StrEnum):
    """The constraints that can prevent a path."""

    START = "start"
    REACH = "reach"
    JOINT_LIMIT = "joint limit"
    VISIBILITY = "visibility"
    COLLISION = "collision"
    LOCAL_MINIMUM = "local minimum"


@dataclass(frozen=True, slots=True)
class PlanFailure:
    """A failed plan, which is false as a condition, with the constraint that prevents a path."""

    obstacle: Obstacle
    reason: str  # one sentence for the user
    proved: bool = False  # true if no path exists, false if none was found

    def __bool__(self) -> bool:
        """A failure is false."""
        return False

    def __str__(self) -> str:
        """Return obstacle and reason on one line."""
        return f"{self.obstacle.value}: {self.reason}"

    def outcome(self, time: float) -> Outcome:
        """Return this failure as the outcome of a run."""
        return Outcome(OutcomeKind.INFEASIBLE, str(self), time)
