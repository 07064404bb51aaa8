"""Resumable batches of runs of a cell."""

import hashlib
import json
from collections.abc import Callable, Sequence
from dataclasses import asdict
from pathlib import Path

from vergence.experiments.executor import Executor
from vergence.experiments.results_file import ResultsFile
from vergence.experiments.source import CellSource
from vergence.experiments.trial import Trial, TrialResult


def run_campaign(
    source: CellSource,
    trials: Sequence[Trial],
    folder: Path,
    *,
    executor: Executor | None = None,
    tolerance_px: float = 2.0,
    physics: bool = False,
    progress: Callable[[int, int], None] | None = None,
) -> tuple[TrialResult, ...]:
    """Run the trials that the folder has no result of yet; return all results in their order.

    Args:
        source: of the cell.
        trials: what to run.
        folder: where results are written down as they come; a rerun continues from there.
        executor: runs them; every core of this machine if None.
        tolerance_px: up to which error of the farthest feature a run has converged.
        physics: whether to simulate physics also where the arm can follow commands exactly.
        progress: told how many of how many trials are done.

    Raises:
        InputError: if the folder holds another campaign's results, or there is no such scheduler.
        WorkersLostError: if every worker dies that is given the same trials.
    """
    text = json.dumps([asdict(trial) for trial in trials], sort_keys=True)
    campaign = {
        "cell": source.name,
        "cell file": hashlib.sha256(source.load().text.encode()).hexdigest(),
        "trials": hashlib.sha256(text.encode()).hexdigest(),
        "tolerance_px": tolerance_px,
        "physics": physics,
    }
    results_file = ResultsFile(folder, campaign)
    tell = progress or _keep_quiet
    tell(len(results_file.results), len(trials))
    missing = [trial for trial in trials if trial.key not in results_file.results]
    for result in (executor or Executor()).run(source, missing, tolerance_px, physics):
        results_file.add(result)
        tell(len(results_file.results), len(trials))
    return tuple(results_file.results[trial.key] for trial in trials)


def _keep_quiet(done: int, total: int) -> None:
    """Tell nobody."""
