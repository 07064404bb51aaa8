"""What a study claims: a number beside the paper's, and whether the claim holds."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

Progress = Callable[[str, float], None]  # what is being done, and the share done so far


@dataclass(frozen=True, slots=True)
class Check:
    """One claim of a paper, measured."""

    name: str
    paper: str  # what the paper says, and when the check holds
    measured: float
    unit: str
    holds: bool
    note: str = ""


@dataclass(frozen=True, slots=True)
class Figure:
    """A picture a study made."""

    path: Path
    caption: str


@dataclass(frozen=True, slots=True)
class StudyResult:
    """All that a study found."""

    title: str
    checks: tuple[Check, ...]
    figures: tuple[Figure, ...]

    @property
    def holds(self) -> bool:
        """Whether every check holds."""
        return all(check.holds for check in self.checks)


def within(measured: float, low: float = float("-inf"), high: float = float("inf")) -> bool:
    """Whether a number is in a closed interval; NaN never is."""
    return low <= measured <= high


def bisect_threshold(
    works: Callable[[float], bool], low: float, high: float, tolerance: float
) -> float:
    """Return the largest value that works, to a relative tolerance, by bisection.

    Args:
        works: monotone: true below the threshold, false above.
        low: tried first; if it does not work, NaN is returned.
        high: tried next; if it works, it is returned.
        tolerance: relative width at which to stop.
    """
    if not works(low):
        return float("nan")
    if works(high):
        return high
    while high - low > tolerance * low:
        middle = (low * high) ** 0.5
        low, high = (middle, high) if works(middle) else (low, middle)
    return low
