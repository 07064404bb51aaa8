"""What a study claims: a number beside the paper's, and whether the claim holds."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from vergence.drawing import save
from vergence.errors import InputError, nearest

Progress = Callable[[str, float], None]  # what is being done, and the share done so far


class Spread(NamedTuple):
    """What a check measured when its study was repeated with several seeds."""

    seeds: int
    held: int  # seeds with which the check holds
    median: float
    low: float  # the range
    high: float


class Others(NamedTuple):
    """What else was tried besides what a check measures, such as other laws."""

    meaning: str  # of the results
    results: tuple[tuple[str, str], ...]  # what was tried, and what came of it, in words


@dataclass(frozen=True, slots=True)
class Check:
    """One claim of a paper, measured."""

    name: str
    paper: str  # what the paper says
    measured: float  # with the first seed
    unit: str
    holds: bool  # with every seed
    note: str = ""
    bound: str = ""  # within which the check holds, where the paper's words give none
    spread: Spread | None = None  # over several seeds
    others: Others | None = None


@dataclass(frozen=True, slots=True)
class Figure:
    """A figure a study made."""

    path: Path  # of the file it was written to
    caption: str
    drawing: Any = None  # matplotlib's, None for what was read from a file

    def savefig(self, path: str | Path) -> None:
        """Write it to another file, in the format that its name ends with."""
        if self.drawing is None:
            Path(path).write_bytes(self.path.read_bytes())
        else:
            save(self.drawing, path)


@dataclass(frozen=True, slots=True)
class StudyResult:
    """All that a study found."""

    title: str
    checks: tuple[Check, ...]
    figures: tuple[Figure, ...]
    seed: int = 0  # of what is drawn by chance
    seeds: int = 1  # how many were tried, from that one on

    def figure(self, number: int | str) -> Figure:
        """Return a figure by its number in the paper, or by the name of its file.

        Raises:
            InputError: if there is no such figure.
        """
        name = f"figure_{number:02d}" if isinstance(number, int) else number
        by_name = {figure.path.stem: figure for figure in self.figures}
        if name not in by_name:
            raise InputError("figure", "", number, nearest(name, by_name))
        return by_name[name]

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
