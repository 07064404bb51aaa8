"""Runs the benchmarks: every `bench_*.py` here, or those named; prints a table, or JSON.

    python benchmarks/run.py [--json] [NAME...]

A benchmark is a module with `run() -> list[dict]`, rows as `harness.row` makes them. The exit code
is 1 when an aim does not hold.
"""

import argparse
import importlib
import json
import sys
from pathlib import Path
from typing import Any

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE))


def discover(names: list[str]) -> list[str]:
    """The benchmarks' module names, of `control` as well as of `bench_control`."""
    found = sorted(path.stem for path in HERE.glob("bench_*.py"))
    wanted = [name if name.startswith("bench_") else f"bench_{name}" for name in names]
    unknown = sorted(set(wanted) - set(found))
    if unknown:
        sys.exit(f"no benchmark {', '.join(unknown)}; there are: {', '.join(found)}")
    return wanted or found


def number(value: float | None) -> str:
    return "" if value is None else f"{value:.3g}"


def table(rows: list[dict[str, Any]]) -> None:
    from rich.console import Console
    from rich.table import Table

    view = Table(title="benchmarks: medians, quartiles in brackets")
    for heading in ("case", "ours", "peer", "its", "ratio", "aim", "holds"):
        view.add_column(heading)
    for row in rows:
        spread = "" if row["low"] is None else f" ({number(row['low'])}–{number(row['high'])})"
        view.add_row(
            row["name"],
            f"{number(row['value'])} {row['unit']}{spread}",
            row["peer"] or "",
            number(row["peer_value"]),
            number(row["ratio"]),
            row["aim"] or "",
            {True: "yes", False: "NO", None: "-"}[row["holds"]],
        )
    Console(width=None if sys.stdout.isatty() else 160).print(view)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("names", nargs="*", metavar="NAME", help="which benchmarks (all)")
    parser.add_argument("--json", action="store_true", help="one JSON object on stdout")
    options = parser.parse_args()
    rows: list[dict[str, Any]] = []
    for name in discover(options.names):
        print(f"{name} …", file=sys.stderr)
        rows += importlib.import_module(name).run()
    if options.json:
        print(json.dumps({"benchmarks": rows}))
    else:
        table(rows)
    return 1 if any(row["holds"] is False for row in rows) else 0


if __name__ == "__main__":
    sys.exit(main())
