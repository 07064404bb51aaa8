"""What became of questions about real images: a row for each case and each who was asked."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from vergence.arrays import BoolArray, FloatArray


@dataclass(frozen=True)
class Row:
    """Answers of one kind: right, wrong without saying so, or none.

    The rest is neither right nor wrong: nearly right, or off by no more than what is stated.
    """

    kind: str  # objects, points, tags, boards, pairs
    case: str
    who: str
    total: int  # questions; 0 where nobody could be asked
    right: int = 0
    wrong: int = 0
    lost: int = 0  # said to be lost, not found or refused
    error: float | None = None  # median of the answers that are not wrong
    unit: str = ""  # of the error
    stated: float | None = None  # error over stated deviation, root mean square; 1 is honest
    aim: str | None = None
    holds: bool | None = None

    @property
    def record(self) -> dict[str, Any]:
        return asdict(self)


def missing(kind: str, case: str, who: str) -> Row:
    return Row(kind, case, who, 0)


def median(values: Sequence[float] | FloatArray) -> float | None:
    return float(np.median(values)) if len(values) else None


BEYOND = 5.0  # stated deviations, farther than which an answer is wrong without a warning


def beyond(errors: FloatArray, covariances: FloatArray) -> BoolArray:
    """Which errors (N, K) lie beyond what their covariances (N, K, K) state."""
    whitened = np.linalg.solve(covariances, errors[..., None])[..., 0]
    far: BoolArray = np.sum(errors * whitened, axis=1) > BEYOND**2
    return far


def over_stated(errors: FloatArray, covariances: FloatArray) -> float | None:
    """Errors (N, K) over what their covariances (N, K, K) state, root mean square."""
    if not len(errors):
        return None
    whitened = np.linalg.solve(covariances, errors[..., None])[..., 0]
    return float(np.sqrt(np.mean(np.sum(errors * whitened, axis=1) / errors.shape[1])))


def markdown(rows: Sequence[Row]) -> str:
    """The table of one kind."""
    lines = [
        "| case | by | of | right | wrong | lost | error | error / stated | aim |",
        "|---|---|--:|--:|--:|--:|--:|--:|---|",
    ]
    before = ""
    for row in rows:
        case = "" if row.case == before else row.case
        before = row.case
        if not row.total:
            lines.append(f"| {case} | {row.who} | | | | | | | |")
            continue
        error = "" if row.error is None else f"{row.error:.2g} {row.unit}"
        stated = "" if row.stated is None else f"{row.stated:.2g}"
        verdict = {True: "holds", False: "**does not hold**", None: ""}[row.holds]
        aim = f"{row.aim}: {verdict}" if row.aim else ""
        counts = f"{row.total} | {row.right} | {row.wrong} | {row.lost}"
        lines.append(f"| {case} | {row.who} | {counts} | {error} | {stated} | {aim} |")
    return "\n".join(lines)
