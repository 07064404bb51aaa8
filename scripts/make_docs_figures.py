"""Make what the documentation shows of our own runs: figures, checks, the table of the laws.

    scripts/make_docs_figures.py [nelson1995 … guarantees honesty photograph imaging defaults laws]

It runs `vergence reproduce` and `vergence compare` in full, which takes about half an hour, and
writes images into docs/images and tables into docs/papers and docs/guide. The papers' studies are
repeated with ten seeds on exact projections. What is already in build/docs is not run again: delete
it to start afresh.
"""

import csv
import json
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

PROJECT = Path(__file__).parents[1]
DOCS = PROJECT / "docs"
BUILD = PROJECT / "build" / "docs"
VERGENCE = Path(sys.executable).with_name("vergence")

PAPERS = (
    "nelson1995",
    "lippiello2005",
    "mezouar2001",
    "guarantees",
    "honesty",
    "region",
    "features",
    "imaging",
    "photograph",
    "defaults",
)
SPREAD = ("nelson1995", "lippiello2005", "mezouar2001")  # repeated with several seeds
SEEDS = 10
LAWS = "image_based,image_based_desired,image_based_mean,point_pose,optimal_tracking,constrained"
STARTS = 100
COMPARED = (("ur5", 0.2), ("panda", 0.2), ("ur5", 0.5), ("panda", 0.5))  # share of joints' ranges


def answer(name: str, *command: str) -> dict[str, Any]:
    """Run a command of vergence once; return what it answers."""
    file = BUILD / f"{name}.json"
    if not file.is_file():
        print("vergence", *command, flush=True)
        BUILD.mkdir(parents=True, exist_ok=True)
        run = subprocess.run(
            [VERGENCE, *command, "--out", BUILD / name, "--json"], stdout=subprocess.PIPE
        )
        file.write_bytes(run.stdout)
    result: dict[str, Any] = json.loads(file.read_text())
    return result


def reproduce(paper: str) -> None:
    """Write a study's checks and figures."""
    checks = answer(paper, "reproduce", paper)["checks"]
    seeds = ("--quick", "--seeds", str(SEEDS))
    repeated = answer(f"{paper}-seeds", "reproduce", paper, *seeds) if paper in SPREAD else {}
    spreads = {check["name"]: check["spread"] for check in repeated.get("checks", ())}
    lines = _checks(checks, spreads)
    held = sum(check["holds"] for check in checks)
    lines += ["", f"{held} of {len(checks)} checks hold."]
    if spreads:
        everywhere = sum(spread["held"] == spread["seeds"] for spread in spreads.values())
        lines[-1] += (
            f" The spread, median and range, is over {SEEDS} seeds on exact projections "
            f"(`vergence reproduce {paper} {' '.join(seeds)}`), which differ from rendered images: "
            f"{everywhere} checks hold with every seed."
        )
    lines += ["", "Further measurements:", ""]
    lines += [f"- `{check['name']}`: {check['note']}" for check in checks if check["note"]]
    lines += _others(paper, checks)
    (DOCS / "papers" / f"_{paper}.md").write_text("\n".join(lines) + "\n")
    _copy_figures(paper)


def _others(paper: str, checks: list[dict[str, Any]]) -> list[str]:
    """Return tables of what else was tried, a column a check; checks of the same share a table."""
    tables: dict[tuple[str, ...], list[dict[str, Any]]] = {}
    for check in checks:
        if others := check["others"]:
            tables.setdefault((others["meaning"], *others["results"]), []).append(check)
    lines = []
    for (meaning, *names), columns in tables.items():
        headings = (_words(check["name"].removeprefix(f"{paper}.")) for check in columns)
        lines += ["", f"{meaning}:", "", f"| | {' | '.join(headings)} |"]
        lines.append("|---" + "|--:" * len(columns) + "|")
        for name in names:
            results = (column["others"]["results"][name] for column in columns)
            lines.append(f"| {name} | {' | '.join(results)} |")
    return lines


def _words(name: str) -> str:
    """Return a check's name as words, which a narrow column may break."""
    return name.replace(".", " ").replace("_", " ")


def _checks(checks: list[dict[str, Any]], spreads: dict[str, dict[str, float]]) -> list[str]:
    """Return a table of checks; columns that nothing fills are left out."""
    titles = ["check", "claim", "bound", "measured", "holds", f"{SEEDS} seeds", "held"]
    rows = []
    for check in checks:
        spread = spreads.get(check["name"])
        measured = f"{check['measured']:.3g} {check['unit']}".strip()
        row = [f"`{check['name']}`", check["paper"], check["bound"], measured]
        row += ["yes" if check["holds"] else "**no**", _spread(spread)]
        rows.append([*row, f"{spread['held']} of {spread['seeds']}" if spread else ""])
    filled = [k for k in range(len(titles)) if any(row[k] for row in rows)]
    lines = ["| " + " | ".join(titles[k] for k in filled) + " |"]
    right = (titles.index("measured"), titles.index("held") - 1)
    lines.append("|" + "|".join("--:" if k in right else "---" for k in filled) + "|")
    shown = ([row[k].replace("|", "\\|") for k in filled] for row in rows)
    return [*lines, *("| " + " | ".join(cells) + " |" for cells in shown)]


def _spread(spread: dict[str, float] | None) -> str:
    if spread is None:
        return ""
    low, high = f"{spread['low']:.3g}", f"{spread['high']:.3g}"
    median = f"{spread['median']:.3g}"
    return median if low == high else f"{median} ({low} … {high})"


def _copy_figures(paper: str) -> None:
    images = DOCS / "images" / paper
    images.mkdir(parents=True, exist_ok=True)
    for old in images.glob("*.svg"):
        old.unlink()
    for drawing in sorted((BUILD / paper).glob("*.svg")):
        (images / drawing.name).write_text(slim(drawing.read_text()))


def slim(svg: str) -> str:
    """Drop what of an SVG no screen shows: digits, comments, indents."""
    svg = re.sub(r"<metadata>.*?</metadata>|<!--.*?-->", "", svg, flags=re.DOTALL)
    svg = re.sub(r"\s*\n\s*", "\n", svg)
    svg = re.sub(r"-?\d{2,}\.\d{2,}", lambda number: f"{float(number[0]):.1f}", svg)
    return re.sub(r"-?\d\.\d{3,}", lambda number: f"{float(number[0]):.2g}", svg)


def imaging() -> None:
    """Write the table of what laws and trackers lose by a real camera."""
    reproduce("imaging")
    with (BUILD / "imaging" / "imaging.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    lines = [
        "| | | cell | final error: ideal | real | tracking: ideal | real | lost: ideal | real |",
        "|---|---|---|--:|--:|--:|--:|--:|--:|",
    ]
    for row in rows:
        errors = [
            f"{float(row[f'{kind}_{images}']):.2g} {row[unit]}".replace("nan", "–")
            for kind, unit in (("final", "unit"), ("tracking", "tracking_unit"))
            for images in ("ideal", "real")
        ]
        lost = [f"{row[f'lost_{images}']} of {row['runs']}" for images in ("ideal", "real")]
        cell = f"`{row['cell']}`" if row["cell"] else "films"
        cells = (row["role"], row["name"].replace("_", " "), cell, *errors, *lost)
        lines.append("| " + " | ".join(cells) + " |")
    (DOCS / "papers" / "_imaging_table.md").write_text("\n".join(lines) + "\n")


def compare() -> None:
    """Write the tables of the laws."""
    lines = []
    for cell, spread in COMPARED:
        options = ("--laws", LAWS, "--starts", str(STARTS), "--spread", str(spread))
        still = ("--set", 'target.motion={kind="stationary"}', "--set", "duration_s=8")
        found = answer(f"laws-{cell}-{spread}", "compare", cell, *options, *still)
        lines += [f"**{cell}**, starts over {spread:.0%} of the joints' ranges", ""]
        lines += [*_table(found["laws"]), ""]
    (DOCS / "guide" / "_laws.md").write_text("\n".join(lines))


def _table(laws: list[dict[str, Any]]) -> list[str]:
    endings = [
        key for key in laws[0] if key not in ("law", "starts") and not key.startswith("median")
    ]
    shown = [key for key in endings if any(law[key] for law in laws)]
    titles = ["law", *(key.replace("_", " ") for key in shown), "time (s)", "path (m)"]
    lines = ["| " + " | ".join(titles) + " |", "|---" + "|--:" * (len(titles) - 1) + "|"]
    for law in laws:
        medians = (law["median_time_s"], law["median_path_m"])
        counts = [str(law[key]) for key in shown]
        cells = [f"`{law['law']}`", *counts, *("–" if m is None else f"{m:.2f}" for m in medians)]
        lines.append("| " + " | ".join(cells) + " |")
    return lines


def main() -> None:
    """Make what is named on the command line, or all."""
    desired = sys.argv[1:] or [*PAPERS, "laws"]
    for name in desired:
        if name == "laws":
            compare()
        elif name == "imaging":
            imaging()
        else:
            reproduce(name)


if __name__ == "__main__":
    main()
