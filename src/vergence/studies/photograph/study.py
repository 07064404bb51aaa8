"""How surely a photograph is reached: random photographs and starts, in rendered images.

Half of the photographs have a fifth of them covered, a quarter is by another camera, and the light
changes between photograph and run. No distance is given. The first of them are tried in other ways
as well: along the paper's path, and without a plan.
"""

from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path

import numpy as np

from vergence.experiments.workers import Workers
from vergence.signals import OutcomeKind
from vergence.studies.check import Check, Progress, StudyResult, within
from vergence.studies.figure_files import save_figures
from vergence.studies.photograph.figures import TOLERANCE_DEG, TOLERANCE_M, End, ends, errors
from vergence.studies.photograph.methods import Method
from vergence.studies.photograph.trials import TrialResult, run_trial

TRIALS, QUICK = 200, 20
COMPARED, COMPARED_QUICK = 40, 2  # of the trials, by each of the other methods


def reproduce(
    out: Path, quick: bool, progress: Progress, seed: int, imaging: str | None = None
) -> StudyResult:
    """Run the trials and hold them against what is promised."""
    counts = dict.fromkeys(Method, COMPARED_QUICK if quick else COMPARED)
    counts[Method.OPTIMISED] = QUICK if quick else TRIALS
    total = sum(counts.values())
    found: dict[Method, list[TrialResult]] = {}
    with Workers() as pool:
        for method, count in counts.items():
            told = partial(_tell, progress, method, sum(map(len, found.values())), count, total)
            found[method] = pool.try_all(
                partial(run_trial, seed, method, imaging=imaging), count, told
            )
    return result_of(found, out, seed)


def _tell(
    progress: Progress, method: Method, done: int, count: int, total: int, share: float
) -> None:
    progress(f"{count} photographs, {method.value}", (done + share * count) / total)


def result_of(found: Mapping[Method, Sequence[TrialResult]], out: Path, seed: int) -> StudyResult:
    """Return checks and figures of trials, by method."""
    results = found[Method.OPTIMISED]
    drawn = {"errors": (errors(results), _ERRORS), "methods": (ends(found), _METHODS)}
    checks = (*checks_of(results), *_other_methods(found))
    return StudyResult("Reaching a photograph", checks, save_figures(out, drawn), seed)


def checks_of(results: Sequence[TrialResult]) -> tuple[Check, ...]:
    """Return what is promised beside what was measured."""
    feasible = [r for r in results if r.feasible]
    reached = [r for r in results if r.outcome is OutcomeKind.REACHED]
    wrong = [r for r in reached if End.of(r) is not End.WITHIN]
    refused = [r for r in results if not r.moved]
    lost = sum(r.outcome is not OutcomeKind.REACHED for r in feasible)
    share = 100.0 * (1.0 - lost / max(len(feasible), 1))
    mm = np.array([1e3 * r.final_m for r in reached] or [np.nan])
    deg = np.array([r.final_deg for r in reached] or [np.nan])
    of_all = (
        f"{len(reached)} of {len(results)} trials reached; "
        f"tolerance {1e3 * TOLERANCE_M:g} mm and {TOLERANCE_DEG:g}°"
    )
    return (
        Check(
            "photograph.reached", "reached from at least 97 % of the feasible starts", share, "%",
            within(share, 97.0), f"{len(feasible)} feasible, {lost} of them not reached",
        ),
        Check(
            "photograph.reached_wrongly", "no run reports reached outside the tolerance",
            len(wrong), "", not wrong, of_all,
        ),
        _most("photograph.median_mm", "median final distance", 0.3, float(np.median(mm)), "mm"),
        _most("photograph.median_deg", "median final angle", 0.05, float(np.median(deg)), "°"),
        _most("photograph.worst_mm", "largest final distance", 3.0, float(mm.max()), "mm"),
        _most("photograph.worst_deg", "largest final angle", 0.7, float(deg.max()), "°"),
        Check(
            "photograph.refused", "every run that is refused before a move says why",
            len(refused), "",
            all(r.reason for r in refused),
            f"refused: {len(refused)} of {len(results)}, "
            f"{sum(r.feasible for r in refused)} of them feasible",
        ),
    )  # fmt: skip


def _other_methods(found: Mapping[Method, Sequence[TrialResult]]) -> Iterator[Check]:
    """Hold the other methods against ours, on the feasible ones of the trials that both made."""
    for method, results in found.items():
        if method is Method.OPTIMISED:
            continue
        own = found[Method.OPTIMISED][: len(results)]
        ours, theirs = _within_share(own), _within_share(results)
        count = sum(r.feasible for r in results)
        yield Check(
            f"photograph.{method.name.lower()}",
            "ends within the tolerance no more often than vergence, of the feasible starts",
            theirs, "%", within(theirs, high=ours), f"{count} feasible; vergence {ours:.0f} %",
        )  # fmt: skip


def _within_share(results: Sequence[TrialResult]) -> float:
    return 100.0 * float(np.mean([End.of(r) is End.WITHIN for r in results if r.feasible]))


_ERRORS = (
    "Final distance of the camera from the goal over its initial distance, for every photograph "
    "that was reached. Dashed: the tolerance."
)
_METHODS = "True final position of the camera by method, whatever the run reported."


def _most(name: str, what: str, most: float, measured: float, unit: str) -> Check:
    claim = f"{what} from the goal, where reached: at most {most:g} {unit}".replace(" °", "°")
    return Check(name, claim, measured, unit, within(measured, high=most))
