"""A run of the benchmarks beside an earlier one."""

import json
from pathlib import Path
from typing import Any


class UnusableBaseline(ValueError):
    """A file that is no earlier run; the message says what is wrong with it."""


def read_baseline(path: Path) -> list[dict[str, Any]]:
    """The rows that `run.py --json` printed into a file.

    Raises:
        UnusableBaseline: if the file is not such output.
    """
    try:
        rows = json.loads(path.read_text(encoding="utf-8"))["benchmarks"]
        return [row for row in rows if row["name"] and row["value"] is not None]
    except (OSError, ValueError, KeyError, TypeError) as error:
        reason = error.strerror if isinstance(error, OSError) else "it is not what --json prints"
        raise UnusableBaseline(
            f"{path}: {reason}; allowed: a file that `vergence bench --json > FILE` wrote"
        ) from None


def beside(rows: list[dict[str, Any]], baseline: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Rows with `before`, the earlier value, and `change`, now over before.

    Where both runs have a ratio to the same peer, the change is that of the ratio: both sides of
    a ratio are slowed alike by a busy machine, and by another machine. Both are None for a row
    that the baseline lacks.
    """
    known = {(row["name"], row["peer"]): row for row in baseline}
    compared = []
    for row in rows:
        before = known.get((row["name"], row["peer"]))
        change = None
        if before is not None:
            key = "ratio" if row["ratio"] and before.get("ratio") else "value"
            change = row[key] / before[key] if before[key] else None
        earlier = None if before is None else before["value"]
        compared.append(row | {"before": earlier, "change": change})
    return compared
