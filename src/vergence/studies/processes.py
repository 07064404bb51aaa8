"""Many cases on every core."""

import os
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from contextlib import AbstractContextManager, nullcontext
from multiprocessing import get_context
from typing import TypeVar

Result = TypeVar("Result")


def processes(
    workers: int | None = None,
) -> AbstractContextManager[ProcessPoolExecutor | None]:
    """Return a pool of processes; None, which means this one, for one worker.

    Args:
        workers: how many; as many as there are cores if None.
    """
    workers = workers or len(os.sched_getaffinity(0))
    if workers == 1:
        return nullcontext()
    return ProcessPoolExecutor(workers, get_context("spawn"), initializer=_one_thread)


def try_all(
    case: Callable[[int], Result],
    count: int,
    pool: ProcessPoolExecutor | None = None,
    progress: Callable[[float], None] = lambda _share: None,
) -> list[Result]:
    """Return the results of cases 0 … count - 1, in order.

    Args:
        case: a function of the case's number that can be sent to a process.
        count: how many.
        pool: see `processes`.
        progress: told the share done.
    """
    results = []
    ongoing = pool.map(case, range(count), chunksize=2) if pool else map(case, range(count))
    for result in ongoing:
        results.append(result)
        progress(len(results) / count)
    return results


def _one_thread() -> None:
    """Keep a process to one core: the others have their own."""
    import numba

    numba.set_num_threads(1)
