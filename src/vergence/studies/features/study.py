"""Every feature: its matrix against differences, and servoing by it beside ViSP."""

from collections import Counter
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from vergence.drawing import figure, legend
from vergence.experiments.workers import Workers
from vergence.studies.check import Check, Progress, StudyResult, within
from vergence.studies.ending_bars import ending_bars
from vergence.studies.features import visp
from vergence.studies.features.matrices import matrix_errors
from vergence.studies.features.scene import KINDS, Start, draw_start
from vergence.studies.features.servo import Servoing, servo
from vergence.studies.figure_files import save_figures
from vergence.studies.ideal_loop import Ending

TITLE = "Servoing with every kind of feature, compared with ViSP"
STARTS, QUICK_STARTS = 300, 20
_POSES, _QUICK_POSES = 1000, 50
_ERROR_MAX = 1e-6
_LEAST_ON_ARM = 0.9
FREE, ARM, AVOIDANCE = "free", "arm", "avoidance"
OURS, VISP = "vergence", "ViSP"

# What became of the servoings by (program, plant, kind), a row a start.
Servoings = Mapping[tuple[str, str, str], Sequence[Servoing]]


def reproduce(out: Path, quick: bool, progress: Progress, seed: int = 0) -> StudyResult:
    """Servo from every start by every kind of feature, ours on every core, ViSP's on one.

    Args:
        out: folder for the figure.
        quick: a few starts and poses.
        progress: called with the current step.
        seed: of starts and poses.
    """
    count = QUICK_STARTS if quick else STARTS
    progress("interaction matrices", 0.0)
    errors = matrix_errors(_QUICK_POSES if quick else _POSES, seed)
    starts = [draw_start(seed, number) for number in range(count)]
    found: dict[tuple[str, str, str], list[Servoing]] = {}
    told = partial(progress, f"{count} starts")
    with Workers() as pool:
        tried = pool.try_all(partial(_try_start, seed), count, lambda share: told(0.7 * share))
    for n, (plant, kind) in enumerate(_CASES):
        found[OURS, plant, kind] = [start[n] for start in tried]
    version = ""
    if visp.installed():
        progress("the same with ViSP", 0.7)
        version, theirs = _with_visp(starts)
        found |= theirs
    caption = _CAPTION if version else f"{_CAPTION} {visp.MISSING}."
    figures = save_figures(out, {"features": (_endings(found), caption)})
    return StudyResult(TITLE, checks_of(errors, starts, found, version), figures, seed)


_CASES = [(plant, kind) for plant in (FREE, ARM) for kind in KINDS]


def _try_start(seed: int, number: int) -> list[Servoing]:
    start = draw_start(seed, number)
    return [servo(kind, start, plant == ARM) for plant, kind in _CASES]


def _with_visp(
    starts: Sequence[Start],
) -> tuple[str, dict[tuple[str, str, str], list[Servoing]]]:
    cases = [(plant, kind) for plant in (FREE, ARM, AVOIDANCE) for kind in KINDS]
    asked = [visp.Asked(kind, plant, start) for plant, kind in cases for start in starts]
    version, answers = visp.servo_with_visp(asked)
    rows = [answers[n : n + len(starts)] for n in range(0, len(answers), len(starts))]
    return version, {(VISP, *case): row for case, row in zip(cases, rows, strict=True)}


def checks_of(
    errors: Mapping[str, float], starts: Sequence[Start], found: Servoings, version: str
) -> tuple[Check, ...]:
    """Return the checks.

    Args:
        errors: of the interaction matrix of each feature.
        starts: of all servoings.
        found: by program, plant and kind; ViSP's may be missing.
        version: of ViSP; empty if it is not installed.
    """
    worst = max(errors, key=lambda kind: errors[kind])
    checks = [
        Check(
            "features.matrix_error_max",
            f"largest difference of L v from central differences: at most {_ERROR_MAX:g}",
            errors[worst], "", within(errors[worst], high=_ERROR_MAX),
            f"{len(errors)} features; largest: {worst}" + ("" if version else f". {visp.MISSING}"),
        )
    ]  # fmt: skip
    for kind in KINDS:
        checks += [_converged(kind, found, version), _free(kind, starts, found, version)]
    return (*checks, *_limits(found, version))


def _converged(kind: str, found: Servoings, version: str) -> Check:
    """Check how often an arm under limits arrives."""
    share = arrived(found[OURS, ARM, kind])
    least, beside = _LEAST_ON_ARM, ""
    expected = f"runs on the arm that arrive: at least {100 * _LEAST_ON_ARM:g} %"
    if version:
        expected += ", and no fewer than ViSP"
        plain, avoiding = (arrived(found[VISP, plant, kind]) for plant in (ARM, AVOIDANCE))
        least = max(least, plain, avoiding)
        beside = f"{version}: {100 * plain:.1f} %, {100 * avoiding:.1f} % with its avoidance of "
        beside += "joint limits"
    holds = within(share, least)
    return Check(f"features.converged.{kind}", expected, 100.0 * share, "%", holds, beside)


def _free(kind: str, starts: Sequence[Start], found: Servoings, version: str) -> Check:
    """Check how often a free camera arrives, and how long its path is."""
    share, ratio = arrived(found[OURS, FREE, kind]), path_ratio(found[OURS, FREE, kind], starts)
    note, least = f"path {ratio:.3f} times as long as a straight one (median)", _LEAST_ON_ARM
    if version:
        theirs = found[VISP, FREE, kind]
        least = arrived(theirs)
        note += f"; {version}: {100 * least:.1f} %, {path_ratio(theirs, starts):.3f} times"
    bound = "no fewer than ViSP" if version else f"at least {100 * least:g} %"
    expected = f"runs of a free camera that arrive: {bound}"
    return Check(f"features.free.{kind}", expected, 100.0 * share, "%", within(share, least), note)


def _limits(found: Servoings, version: str) -> tuple[Check, Check]:
    """Check that no servoing of ours on the arm passes a joint's limits, and few lose the view."""

    def count(program: str, plant: str, ending: Ending) -> int:
        runs = [run for kind in KINDS for run in found[program, plant, kind]]
        return sum(
            run.ending is ending or (ending is Ending.JOINT and run.too_fast) for run in runs
        )

    total = sum(len(found[OURS, ARM, kind]) for kind in KINDS)
    checks = []
    for name, expected, ending, most in (
        (
            "limits_passed",
            "on the arm: no run passes a joint's position or rate limit",
            Ending.JOINT,
            0.0,
        ),
        (
            "left_view",
            "on the arm: features leave the image in at most 1 of 100 runs",
            Ending.VIEW,
            0.01 * total,
        ),
    ):
        note, passes = "", count(OURS, ARM, ending)
        if version:
            theirs = [count(VISP, plant, ending) for plant in (ARM, AVOIDANCE)]
            note = f"{version}: {theirs[0]}, {theirs[1]} with its avoidance"
        checks.append(
            Check(
                f"features.{name}",
                expected,
                float(passes),
                f"of {total}",
                within(float(passes), high=most),
                note,
            )
        )
    return checks[0], checks[1]


def arrived(runs: Sequence[Servoing]) -> float:
    """Return the share of servoings that arrived."""
    return sum(run.ending is Ending.ARRIVED for run in runs) / len(runs)


def path_ratio(runs: Sequence[Servoing], starts: Sequence[Start]) -> float:
    """Return the median path of the camera over the straight one, of those that arrived."""
    ratios = [
        run.path_m / start.straight_m
        for run, start in zip(runs, starts, strict=True)
        if run.ending is Ending.ARRIVED
    ]
    return float(np.median(ratios)) if ratios else float("nan")


_CAPTION = (
    "How runs from the same starts ended, with a free camera without limits and with one on an "
    "arm; vergence keeps the arm's limits, ViSP's secondary task avoids joint limits."
)
_NAMES = {"2.5d": "2½D"}
_LABELS = {FREE: VISP, ARM: VISP, AVOIDANCE: f"{VISP}, avoidance"}


def _endings(found: Servoings) -> Any:
    drawing, axes = figure(7.6, 6.0 if (VISP, FREE, KINDS[0]) in found else 3.6, 2, sharex=True)
    for panel, title, plants in (
        (axes[0], "free camera", (FREE,)),
        (axes[1], "arm", (ARM, AVOIDANCE)),
    ):
        names, counts = [], []
        for kind in KINDS:
            rows = [(OURS, plants[0]), *((VISP, plant) for plant in plants)]
            for program, plant in rows:
                if (program, plant, kind) in found:
                    label = (
                        _LABELS[plant] if program == VISP else f"{_NAMES.get(kind, kind)}: {OURS}"
                    )
                    names.append(label)
                    counts.append(Counter(run.ending for run in found[program, plant, kind]))
        ending_bars(panel, names, counts)
        panel.set_title(title, loc="left", fontsize=9)
    axes[1].set_xlabel("of the starts (%)")
    legend(axes[1], axes[0])
    return drawing
