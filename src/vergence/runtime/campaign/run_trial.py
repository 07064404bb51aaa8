"""One trial, in whatever process."""

from vergence.errors import InputError
from vergence.outcome import OutcomeKind
from vergence.runtime.campaign.source import CellSource
from vergence.runtime.campaign.trace import TrialTrace
from vergence.runtime.campaign.trial import Ending, Trial, TrialResult
from vergence.runtime.run_cell import run_cell


def run_trial(source: CellSource, trial: Trial, tolerance_px: float) -> TrialResult:
    """Run a trial on exact projections; the same arguments give the same result anywhere.

    Args:
        source: of the cell.
        trial: what to change in it.
        tolerance_px: up to which error of the farthest feature a run has converged.

    Raises:
        KeyboardInterrupt: if the user stopped it.
    """
    try:
        cell = source.load().replace(**trial.changes)
        trace = TrialTrace(cell.task.camera)
        result = run_cell(cell, [trace], images=False)
    except InputError as error:
        return _refused(trial, str(error))
    if result.outcome.kind is OutcomeKind.STOPPED:  # no result of the trial, but Ctrl-C
        raise KeyboardInterrupt
    return trace.result(trial, result.outcome, tolerance_px)


def _refused(trial: Trial, reason: str) -> TrialResult:
    nowhere = (0.0, 0.0, 0.0)
    return TrialResult(
        trial.key,
        trial.labels,
        Ending.REFUSED,
        reason,
        0.0,
        None,
        None,
        None,
        0.0,
        0.0,
        False,
        nowhere,
        nowhere,
        nowhere[:2],
        nowhere[:2],
    )
