"""Who runs the trials: this process, processes of this machine, or a cluster."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from math import ceil

from vergence.cell import Cell
from vergence.errors import InputError, VergenceError
from vergence.experiments.kinematic import is_ideal, is_quick
from vergence.experiments.run_trial import as_they_come, run_trials
from vergence.experiments.source import CellSource
from vergence.experiments.trial import Trial, TrialResult
from vergence.experiments.worker import prepare_workers
from vergence.experiments.workers import DEATHS, DeadlyTaskError, Workers
from vergence.optional_package import optional_package

_CONNECT_S = 10
_CHUNK = 256  # quick trials handed out at once: about a second of one core
_SHARES = 8  # of a worker: tasks of ideal runs, so that all workers end at much the same time
_MOST = 16  # ideal runs in a task
_SCHEDULER = "the address of a Dask scheduler, such as tcp://10.0.0.1:8786"


class WorkersLostError(VergenceError):
    """No worker is left for some trials, or a trial ends every worker that runs it."""

    def __init__(self, trials: Sequence[Trial], what: str) -> None:
        first, more = trials[0].key, len(trials) - 1
        runs = f"run {first} and {more} more" if more else f"run {first}"
        super().__init__(f"{runs}: {what}")


@dataclass(frozen=True, slots=True)
class Executor:
    """How many processes of this machine, or which scheduler's workers."""

    workers: int | None = None  # every core's if None; 1 is this process
    scheduler: str | None = None  # address of a Dask scheduler, such as tcp://10.0.0.1:8786
    spent: Callable[[float], object] | None = None  # told the CPU time of those processes, s

    def run(
        self,
        source: CellSource,
        trials: Sequence[Trial],
        tolerance_px: float,
        physics: bool = False,
    ) -> Iterator[TrialResult]:
        """Yield results as they come, in any order.

        Trials of a worker that dies are given to another. Without a scheduler quick trials run in
        this process, on as many cores: a thousand of them take less than processes to start.

        Raises:
            InputError: if there is no scheduler at the address, or Dask, which it needs, is not
                installed.
            WorkersLostError: if every worker dies that is given the same trials.
        """
        workers = Workers(self.workers)
        count = workers.count
        shared = self.scheduler is None and min(count, len(trials)) > 1
        if shared and not _by_pace(source, trials[:1], physics)[0]:  # not quick: others share them
            prepare_workers()
        quick, ideal, slow = _by_pace(source, trials, physics)
        if self.scheduler is None:
            for some in _chunks(quick, _CHUNK):
                yield from as_they_come(source, some, tolerance_px, physics, count)
            quick = []
        size = min(_MOST, ceil(len(ideal) / (_SHARES * count)))
        tasks = [*_chunks(quick, _CHUNK), *_chunks(ideal, size), *_chunks(slow, 1)]
        if self.scheduler is not None:
            yield from _by_dask(self.scheduler, source, tasks, tolerance_px, physics)
        elif min(count, len(tasks)) <= 1:
            yield from as_they_come(source, [*ideal, *slow], tolerance_px, physics)
        else:
            do = partial(_run_task, source, tolerance_px, physics)
            try:
                with workers:
                    for _, results in workers.share_out(do, tasks, self.spent):
                        yield from results
            except DeadlyTaskError as error:
                raise WorkersLostError(tasks[error.number], _killed(DEATHS)) from None


def _run_task(
    source: CellSource, tolerance_px: float, physics: bool, task: Sequence[Trial]
) -> list[TrialResult]:
    return run_trials(source, task, tolerance_px, physics)


def _killed(count: int) -> str:
    return f"every worker that took it was killed, {count} in all; out of memory?"


def _by_dask(
    scheduler: str,
    source: CellSource,
    tasks: Sequence[Sequence[Trial]],
    tolerance_px: float,
    physics: bool,
) -> Iterator[TrialResult]:
    distributed = optional_package("a Dask scheduler", "distributed", "cluster", "--scheduler")
    try:
        client = distributed.Client(scheduler, timeout=_CONNECT_S)
    except (OSError, TimeoutError, ValueError) as error:
        raise InputError("--scheduler", "", f"{scheduler} ({error})", _SCHEDULER) from None
    with client:
        given = {
            client.submit(run_trials, source, task, tolerance_px, physics, pure=False): task
            for task in tasks
        }
        for future in distributed.as_completed(given):
            try:
                yield from future.result()
            except distributed.scheduler.KilledWorker as error:
                what = _killed(error.allowed_failures + 1)
                raise WorkersLostError(given[future], what) from None
            except distributed.client.FutureCancelledError:
                raise WorkersLostError(given[future], "the scheduler has disappeared") from None


def _by_pace(
    source: CellSource, trials: Sequence[Trial], physics: bool
) -> tuple[list[Trial], list[Trial], list[Trial]]:
    """Return trials for the batch kernel, those whose arm is ideal, and those in physics."""
    cell = source.load()
    quick: list[Trial] = []
    ideal: list[Trial] = []
    slow: list[Trial] = []
    for trial in trials:
        changed = None if physics else _changed(cell, trial)
        if changed is None or not is_ideal(changed):
            slow.append(trial)
        else:
            (quick if is_quick(changed) else ideal).append(trial)
    return quick, ideal, slow


def _changed(cell: Cell, trial: Trial) -> Cell | None:
    try:
        return cell.replace(**trial.changes)
    except InputError:  # becomes its result
        return None


def _chunks(trials: Sequence[Trial], size: int) -> list[tuple[Trial, ...]]:
    return [tuple(trials[i : i + size]) for i in range(0, len(trials), max(size, 1))]
