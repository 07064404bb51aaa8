"""Why two views told nothing."""

from dataclasses import dataclass
from enum import StrEnum

from vergence.arrays import FloatArray


class TwoViewProblem(StrEnum):
    """The ways matched points can fail to determine motion and structure."""

    TOO_FEW = "too few matches"
    COINCIDENT = "coincident points"
    COLLINEAR = "collinear points"
    NO_TRANSLATION = "no translation between the views"
    WRONG_MATCHES = "no common motion"
    NOT_RECOGNISED = "not recognised"


@dataclass(frozen=True, slots=True)
class TwoViewFailure:
    """A failed reconstruction: false in a condition, with its reason."""

    problem: TwoViewProblem
    reason: str  # one sentence for a person
    rotation: FloatArray | None = None  # (3, 3) *R_c where at least that is known

    def __bool__(self) -> bool:
        """A failure is false."""
        return False

    def __str__(self) -> str:
        """Problem and reason on one line."""
        return f"{self.problem.value}: {self.reason}"
