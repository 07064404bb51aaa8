"""Do errors agree with their stated uncertainty? Random scenes, errors beside stated deviations.

A wrong answer is one whose error lies beyond five of its own deviations, as does every explanation
that it holds if it is ambiguous; an answer where there is nothing to be found is wrong, too, and a
refusal there is right.
"""

from collections.abc import Callable, Sequence
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from vergence.drawing import COLORS, figure, legend
from vergence.experiments.workers import Workers
from vergence.studies.check import Check, Progress, StudyResult, within
from vergence.studies.figure_files import save_figures
from vergence.studies.honesty.answer import Answer

TITLE = "Do errors agree with their stated uncertainty?"
SCENES = {"two_views": 4000, "poses": 6000, "points": 6000, "tags": 4000}  # random scenes each
QUICK = 40  # times fewer
BATCH = 25
WRONG, COVERED = 5.0, 3.0  # deviations
_MOST_WRONG = 1.0  # of a thousand answers
_LEAST_COVERED = 0.99


def reproduce(out: Path, quick: bool, progress: Progress, seed: int = 0) -> StudyResult:
    """Try the scenes on every core; compare errors with their stated deviations.

    Args:
        out: folder for the figure.
        quick: a fortieth of the scenes.
        progress: called with the current step.
        seed: of the scenes.
    """
    batches = [
        (part, first, min(first + BATCH, count))
        for part, full in SCENES.items()
        for count in [full // QUICK if quick else full]
        for first in range(0, count, BATCH)
    ]
    scenes = sum(last - first for _, first, last in batches)
    with Workers() as pool:
        tried = pool.try_all(
            partial(_try, seed, batches),
            len(batches),
            lambda share: progress(f"{scenes} random scenes", share),
        )
    answers = [answer for batch in tried for answer in batch]
    figures = save_figures(out, {"honesty": (_shares(answers), _CAPTION)})
    return StudyResult(TITLE, checks_of(answers, scenes), figures, seed)


def _try(seed: int, batches: Sequence[tuple[str, int, int]], number: int) -> list[Answer]:
    part, first, last = batches[number]
    try_scene: Callable[[np.random.Generator, int], list[Answer]] = import_module(
        f"vergence.studies.honesty.{part}"
    ).try_scene
    kind = list(SCENES).index(part)
    return [
        answer
        for scene in range(first, last)
        for answer in try_scene(np.random.default_rng([seed, kind, scene]), scene)
    ]


def checks_of(answers: Sequence[Answer], scenes: int) -> tuple[Check, ...]:
    """Return the three checks of all answers, then of each kind."""
    kinds = dict.fromkeys(answer.kind for answer in answers)
    checks = _three("honesty", answers, f"{scenes} scenes, {len(answers)} questions")
    for kind in kinds:
        own = [answer for answer in answers if answer.kind == kind]
        ambiguous = np.mean([answer.explanations > 1 for answer in own])
        checks += _three(kind, own, f"{len(own)} questions, {ambiguous:.1%} ambiguous")
    return checks


def _three(name: str, answers: Sequence[Answer], note: str) -> tuple[Check, ...]:
    off = np.array([a.deviations for a in answers if not np.isnan(a.deviations)])
    refused = [a for a in answers if not a.explanations]
    wrong = 1e3 * float(np.mean(off > WRONG)) if len(off) else 0.0
    covered = float(np.mean(off <= COVERED)) if len(off) else 1.0
    return (
        Check(
            f"{name}.wrong_per_1000", "answers beyond 5 σ: at most 1 of 1000", wrong, "",
            within(wrong, high=_MOST_WRONG), note,
        ),
        Check(
            f"{name}.coverage_3sigma", "answers within 3 σ: at least 0.99", covered, "",
            within(covered, _LEAST_COVERED), "" if len(off) else "no answers: all refused",
        ),
        Check(
            f"{name}.refused_share", "every refusal says why", len(refused) / len(answers), "",
            all(a.reason for a in refused),
        ),
    )  # fmt: skip


_CAPTION = "What became of each kind of question: answered within 3 σ, beyond, ambiguous, refused."


_ENDS = {
    "within 3 σ": COLORS[0],
    "ambiguous": COLORS[1],
    "refused": "#999999",
    "beyond 3 σ": COLORS[3],
}


def _end(answer: Answer) -> str:
    if not answer.explanations:
        return "refused"
    if not answer.deviations <= COVERED:
        return "beyond 3 σ"
    return "ambiguous" if answer.explanations > 1 else "within 3 σ"


def _shares(answers: Sequence[Answer]) -> Any:
    kinds = list(dict.fromkeys(answer.kind for answer in answers))[::-1]
    drawing, (axes,) = figure(7.6, 0.32 * len(kinds) + 1.1)
    left = np.zeros(len(kinds))
    for end, color in _ENDS.items():
        own = [[_end(a) == end for a in answers if a.kind == kind] for kind in kinds]
        share = np.array([100.0 * np.mean(some) for some in own])
        axes.barh(kinds, share, left=left, label=end, color=color, height=0.6)
        left = left + share
    axes.set_xlabel("of the questions (%)")
    axes.set_xlim(0, 100)
    axes.grid(visible=False, axis="y")
    legend(axes)
    return drawing
