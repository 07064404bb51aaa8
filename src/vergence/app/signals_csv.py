"""The numbers of a run as a table that any program reads: a row a tick."""

import csv
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from vergence.runtime.results import Run
from vergence.runtime.results.data_frame import tick_columns

SIGNALS = "signals.csv"
_ROWS = 1000  # written at a time, so that a long run takes little memory


def write_signals(run: Run, path: Path) -> None:
    """Write the signals of a run, under the names of `Run.to_frame`; what is unknown is empty."""
    columns = tick_columns(run)
    with path.open("w", newline="", encoding="utf-8") as stream:
        table = csv.writer(stream)
        table.writerow(columns)
        for first in range(0, len(run.times), _ROWS):
            part = ([_cell(v) for v in c[first : first + _ROWS]] for c in columns.values())
            table.writerows(zip(*part, strict=True))


def _cell(value: Any) -> str:
    if isinstance(value, tuple):
        return "; ".join(filter(None, value))
    if isinstance(value, Mapping):
        return "; ".join(f"{name}={amount:.6g}" for name, amount in value.items())
    return "" if value != value else f"{value:.9g}"
