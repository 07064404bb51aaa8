"""How surely a photograph is reached: random photographs and starts, in rendered images.

Half of the photographs have a fifth of them covered, a quarter is by another camera, and the light
changes between photograph and run. No distance is given.
"""

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from vergence.drawing import curve, figure, legend
from vergence.signals import OutcomeKind
from vergence.studies.check import Check, Progress, StudyResult, within
from vergence.studies.figure_files import save_figures
from vergence.studies.photograph_trials import SCENES, TrialResult, run_trial
from vergence.studies.processes import processes, try_all

TRIALS, QUICK = 200, 20
TOLERANCE_M, TOLERANCE_DEG = 1e-3, 0.2  # of the cell


def reproduce(out: Path, quick: bool, progress: Progress, seed: int) -> StudyResult:
    """Run the trials and hold them against what is promised."""
    count = QUICK if quick else TRIALS
    with processes() as pool:
        results = try_all(
            partial(run_trial, seed, "optimised"),
            count,
            pool,
            lambda share: progress(f"{count} photographs", share),
        )
    figures = save_figures(out, {"errors": (_errors(results), _CAPTION)})
    return StudyResult("Reaching a photograph", checks_of(results), figures, seed)


def checks_of(results: Sequence[TrialResult]) -> tuple[Check, ...]:
    """Return what is promised beside what was measured."""
    feasible = [r for r in results if r.feasible]
    reached = [r for r in results if r.outcome is OutcomeKind.REACHED]
    wrong = [r for r in reached if r.final_m > TOLERANCE_M or r.final_deg > TOLERANCE_DEG]
    refused = [r for r in results if not r.moved]
    share = sum(r.outcome is OutcomeKind.REACHED for r in feasible) / max(len(feasible), 1)
    mm = np.array([1e3 * r.final_m for r in reached] or [np.nan])
    deg = np.array([r.final_deg for r in reached] or [np.nan])
    of_all = f"{len(reached)} of {len(results)} trials reached"
    lost = len(feasible) - sum(r.outcome is OutcomeKind.REACHED for r in feasible)
    return (
        Check(
            "photograph.reached", "at least 97 % of the feasible starts", 100 * share, "%",
            within(100 * share, 97.0), f"{len(feasible)} feasible, {lost} of them not reached",
        ),
        Check(
            "photograph.reached_wrongly", "none outside the tolerance", len(wrong), "",
            not wrong, of_all,
        ),
        _most("photograph.median_mm", 0.3, float(np.median(mm)), "mm"),
        _most("photograph.median_deg", 0.05, float(np.median(deg)), "°"),
        _most("photograph.worst_mm", 3.0, float(mm.max()), "mm"),
        _most("photograph.worst_deg", 0.7, float(deg.max()), "°"),
        Check(
            "photograph.refused", "every trial that does not begin says why", len(refused), "",
            all(r.reason for r in refused), f"{sum(r.feasible for r in refused)} of them feasible",
        ),
    )  # fmt: skip


_CAPTION = (
    "Where the camera ended, over where it began; every photograph that was reached. Dashed: the "
    "tolerance that was asked for."
)


def _most(name: str, most: float, measured: float, unit: str) -> Check:
    return Check(name, f"at most {most:g}", measured, unit, within(measured, high=most))


def _errors(results: Sequence[TrialResult]) -> Any:
    drawing, (axes,) = figure(7.6, 3.6)
    for index, scene in enumerate(SCENES):
        reached = [
            r for r in results if r.outcome is OutcomeKind.REACHED and r.trial.scene == scene
        ]
        start = [1e3 * r.start_m for r in reached]
        end = [1e3 * r.final_m for r in reached]
        axes.plot(start, end, "o", color=curve(index)["color"], markersize=4, label=scene)
    axes.axhline(1e3 * TOLERANCE_M, color="#888", linestyle="--")
    axes.set_yscale("log")
    axes.set_xlabel("distance at the start (mm)")
    axes.set_ylabel("distance at the end (mm)")
    legend(axes)
    return drawing
