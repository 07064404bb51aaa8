"""What laws and trackers lose by a camera as bad as a real one, beside ideal images."""

import csv
from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from vergence.drawing import COLORS, figure, legend, logarithmic
from vergence.experiments.workers import Workers
from vergence.studies.check import Check, Progress, StudyResult, within
from vergence.studies.figure_files import save_figures
from vergence.studies.imaging.cases import CASES, IMAGINGS, Case, Measured, Trial, measure

TITLE = "Laws and trackers with a realistic camera"
SEEDS, QUICK_SEEDS = 3, 1
_QUICK = ("points", "region")
_FACTOR = 3.0  # by which the final error may grow …
_FLOOR = {"px": 0.5, "mm": 1.0}  # … and what is added to it: of the noise of ideal images


class Row(NamedTuple):
    """One law or tracker, its runs with ideal images and with real ones."""

    case: Case
    ideal: Sequence[Measured]
    real: Sequence[Measured]


def reproduce(out: Path, quick: bool, progress: Progress, seed: int = 0) -> StudyResult:
    """Run every case with both kinds of images, on every core.

    Args:
        out: folder for the figure and the table, `imaging.csv`.
        quick: two trackers with one seed.
        progress: called with the current step.
        seed: of the first run of each case.
    """
    cases = [case for case in CASES if not quick or case.name in _QUICK]
    count = QUICK_SEEDS if quick else SEEDS
    seeds = range(seed, seed + count)
    trials = dict.fromkeys(case.trial for case in cases)
    jobs = [(trial, imaging, k) for trial in trials for imaging in IMAGINGS for k in seeds]
    with Workers() as pool:
        made = pool.try_all(
            partial(_do, jobs), len(jobs), lambda share: progress(f"{len(jobs)} runs", share)
        )
    found = dict(zip(jobs, made, strict=True))
    rows = [
        Row(case, *([found[case.trial, imaging, k] for k in seeds] for imaging in IMAGINGS))
        for case in cases
    ]
    write_table(out / "imaging.csv", rows)
    drawn = save_figures(out, {"imaging": (_drawing(rows), _CAPTION)})
    return StudyResult(TITLE, tuple(map(check_of, rows)), drawn, seed)


def _do(jobs: Sequence[tuple[Trial, str, int]], number: int) -> Measured:
    return measure(*jobs[number])


def check_of(row: Row) -> Check:
    """Return what is asked of a case beside what was measured."""
    case, ideal, real = row.case, _median(row.ideal, "final"), _median(row.real, "final")
    most = _FACTOR * ideal + _FLOOR[case.unit]
    lost = sum(one.lost for one in row.real)
    tracking = [_median(runs, "tracking") for runs in (row.ideal, row.real)]
    note = (
        f"ideal images: {ideal:.2g} {case.unit}; tracking error {tracking[0]:.2g} → "
        f"{tracking[1]:.2g} {case.tracking_unit}; lost {lost} of {len(row.real)}"
    )
    return Check(
        f"imaging.{case.role}.{case.name}",
        "not lost, and the final error grows little",
        real,
        case.unit,
        not lost and within(real, high=most),
        note,
        f"at most {most:.2g}: {_FACTOR:g} times that of ideal images + {_FLOOR[case.unit]:g}",
    )


def _median(runs: Sequence[Measured], name: str) -> float:
    values = [getattr(one, name) for one in runs if not one.lost]
    return float(np.median(values)) if values else float("nan")


def table(rows: Sequence[Row]) -> Iterator[Mapping[str, Any]]:
    """Yield a line for each case: medians over the runs that were not lost."""
    for row in rows:
        yield {
            "role": row.case.role,
            "name": row.case.name,
            "cell": row.case.trial.cell,
            "unit": row.case.unit,
            "final_ideal": round(_median(row.ideal, "final"), 4),
            "final_real": round(_median(row.real, "final"), 4),
            "tracking_unit": row.case.tracking_unit,
            "tracking_ideal": round(_median(row.ideal, "tracking"), 4),
            "tracking_real": round(_median(row.real, "tracking"), 4),
            "lost_ideal": sum(one.lost for one in row.ideal),
            "lost_real": sum(one.lost for one in row.real),
            "runs": len(row.real),
        }


def write_table(path: Path, rows: Sequence[Row]) -> None:
    """Write a line for each case as CSV."""
    lines = list(table(rows))
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, list(lines[0]))
        writer.writeheader()
        writer.writerows(lines)


_CAPTION = (
    "Final error with ideal images and with the preset real_camera, each run as a mark; runs that "
    "lost the target have none. In pixels; in millimetres for objects followed by their outline."
)


def _drawing(rows: Sequence[Row]) -> Any:
    drawing, (axes,) = figure(7.6, 0.34 * len(rows) + 1.2)
    names = [f"{row.case.name} ({row.case.unit})" for row in rows]
    for n, label in enumerate(IMAGINGS):
        places = [
            (max(one.final, 1e-3), height + 0.2 * (n - 0.5))
            for height, row in enumerate(rows)
            for one in (row.ideal, row.real)[n]
            if not one.lost
        ]
        axes.plot(
            *np.array(places or [(np.nan, np.nan)]).T, "o", color=COLORS[n], markersize=4,
            label=label.replace("_", " "),
        )  # fmt: skip
    axes.set_yticks(range(len(rows)), names)
    axes.invert_yaxis()
    logarithmic(axes, "x")
    axes.set_xlabel("final error")
    axes.grid(visible=False, axis="y")
    legend(axes)
    return drawing
