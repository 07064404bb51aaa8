"""What became of questions about real images: a row for each case and each who was asked."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np


@dataclass(frozen=True)
class Row:
    """Answers of one kind: right, wrong without saying so, or none."""

    kind: str  # objects, points, tags, boards, pairs
    case: str
    who: str
    total: int  # questions; 0 where nobody could be asked
    right: int = 0
    wrong: int = 0
    lost: int = 0  # said to be lost, not found or refused; the rest is neither right nor wrong
    error: float | None = None  # median of the answers that are not wrong
    unit: str = ""  # of the error
    aim: str | None = None
    holds: bool | None = None

    @property
    def record(self) -> dict[str, Any]:
        return asdict(self)


def missing(kind: str, case: str, who: str) -> Row:
    return Row(kind, case, who, 0)


def median(values: Sequence[float]) -> float | None:
    return float(np.median(values)) if len(values) else None


def markdown(rows: Sequence[Row]) -> str:
    """The table of one kind."""
    lines = [
        "| case | by | of | right | wrong | lost | error | aim |",
        "|---|---|--:|--:|--:|--:|--:|---|",
    ]
    before = ""
    for row in rows:
        case = "" if row.case == before else row.case
        before = row.case
        if not row.total:
            lines.append(f"| {case} | {row.who} | | | | | | |")
            continue
        error = "" if row.error is None else f"{row.error:.2g} {row.unit}"
        verdict = {True: "holds", False: "**does not hold**", None: ""}[row.holds]
        aim = f"{row.aim}: {verdict}" if row.aim else ""
        counts = f"{row.total} | {row.right} | {row.wrong} | {row.lost}"
        lines.append(f"| {case} | {row.who} | {counts} | {error} | {aim} |")
    return "\n".join(lines)
