"""Why there is no plan."""

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
    """No plan: false in a condition, with the constraint that stood in the way."""

    obstacle: Obstacle
    reason: str  # one sentence for a person
    proved: bool = False  # whether there is no path at all, as against none found

    def __bool__(self) -> bool:
        """A failure is false."""
        return False

    def __str__(self) -> str:
        """Obstacle and reason on one line."""
        return f"{self.obstacle.value}: {self.reason}"

    def outcome(self, time: float) -> Outcome:
        """Return the end of a run that this failure is."""
        return Outcome(OutcomeKind.INFEASIBLE, str(self), time)
