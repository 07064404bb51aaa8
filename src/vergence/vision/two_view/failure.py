"""The reason why two views give no reconstruction."""

from dataclasses import dataclass
from enum import StrEnum

from vergence.arrays import FloatArray


class TwoViewProblem(StrEnum):
    """The ways in which matched points can fail to determine motion and structure."""

    TOO_FEW = "too few matches"
    COINCIDENT = "coincident points"
    COLLINEAR = "collinear points"
    NO_TRANSLATION = "no translation between the views"
    WRONG_MATCHES = "no common motion"
    NOT_RECOGNISED = "not recognised"


@dataclass(frozen=True, slots=True)
class TwoViewFailure:
    """A failed reconstruction, which is false as a condition, with its reason."""

    problem: TwoViewProblem
    reason: str  # one sentence for the user
    rotation: FloatArray | None = None  # (3, 3) *R_c where at least that is known

    def __bool__(self) -> bool:
        """A failure is false as a condition."""
        return False

    def __str__(self) -> str:
        """Return problem and reason on one line."""
        return f"{self.problem.value}: {self.reason}"
