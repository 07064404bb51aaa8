"""Runs the benchmarks: every `bench_*.py` here, or those named; prints a table, or JSON.

    python benchmarks/run.py [--json] [--compare BASELINE.json] [NAME...]

A benchmark is a module with `run() -> list[dict]`, rows as `harness.row` makes them. The exit code
is 1 when an aim does not hold. A baseline is what `--json` printed at another time: each row is put
beside it.
"""

import argparse
import importlib
import json
import sys
from pathlib import Path
from typing import Any

from baseline import UnusableBaseline, beside, read_baseline

HERE = Path(__file__).parent


def discover(names: list[str]) -> list[str]:
    """The benchmarks' module names, of `control` as well as of `bench_control`."""
    found = sorted(path.stem for path in HERE.glob("bench_*.py"))
    named = [name if name.startswith("bench_") else f"bench_{name}" for name in names]
    unknown = sorted(set(named) - set(found))
    if unknown:
        sys.exit(f"no benchmark {', '.join(unknown)}; there are: {', '.join(found)}")
    return named or found


def number(value: float | None) -> str:
    return "" if value is None else f"{value:.3g}"


def spread(low: float | None, high: float | None) -> str:
    return "" if low is None else f" ({number(low)}–{number(high)})"


def table(rows: list[dict[str, Any]]) -> None:
    from rich.console import Console
    from rich.table import Table

    view = Table(title="benchmarks: medians, quartiles in brackets")
    compared = any("change" in row for row in rows)
    headings = ("case", "ours", "peer", "its", "ratio", "aim", "holds")
    for heading in (*headings, "before", "change") if compared else headings:
        view.add_column(heading)
    for row in rows:
        earlier = (number(row["before"]), number(row["change"])) if compared else ()
        view.add_row(
            row["name"],
            f"{number(row['value'])} {row['unit']}{spread(row['low'], row['high'])}",
            row["peer"] or "",
            number(row["peer_value"]),
            number(row["ratio"]) + spread(row["ratio_low"], row["ratio_high"]),
            row["aim"] or "",
            {True: "yes", False: "NO", None: "-"}[row["holds"]],
            *earlier,
        )
    Console(width=None if sys.stdout.isatty() else 160).print(view)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("names", nargs="*", metavar="NAME", help="which benchmarks (all)")
    parser.add_argument("--json", action="store_true", help="one JSON object on stdout")
    parser.add_argument("--compare", type=Path, metavar="FILE", help="an earlier run's --json")
    options = parser.parse_args()
    try:
        baseline = read_baseline(options.compare) if options.compare else None
    except UnusableBaseline as error:
        print(error, file=sys.stderr)
        return 2
    rows: list[dict[str, Any]] = []
    for name in discover(options.names):
        print(f"{name} …", file=sys.stderr)
        rows += importlib.import_module(name).run()
    if baseline is not None:
        rows = beside(rows, baseline)
    if options.json:
        print(json.dumps({"benchmarks": rows}))
    else:
        table(rows)
    return 1 if any(row["holds"] is False for row in rows) else 0


if __name__ == "__main__":
    sys.exit(main())
