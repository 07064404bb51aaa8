"""Many cases on every core."""

import os
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from contextlib import AbstractContextManager, nullcontext
from multiprocessing import get_context, parent_process
from multiprocessing.connection import wait
from threading import Thread
from typing import TypeVar

Result = TypeVar("Result")


def processes(
    workers: int | None = None,
) -> AbstractContextManager[ProcessPoolExecutor | None]:
    """Return a pool of processes; None, which means this one, for one worker and in a worker.

    Args:
        workers: how many; as many as there are cores if None.
    """
    workers = workers or len(os.sched_getaffinity(0))
    if workers == 1 or parent_process() is not None:
        return nullcontext()
    return ProcessPoolExecutor(workers, get_context("spawn"), initializer=_begin_worker)


def try_all(
    case: Callable[[int], Result],
    count: int,
    pool: ProcessPoolExecutor | None = None,
    progress: Callable[[float], None] = lambda _share: None,
    at_once: int = 2,
) -> list[Result]:
    """Return the results of cases 0 … count - 1, in order.

    Args:
        case: a function of the case's number that can be sent to a process.
        count: how many.
        pool: see `processes`.
        progress: called with the share done.
        at_once: cases that a process is given at a time.
    """
    results = []
    ongoing = pool.map(case, range(count), chunksize=at_once) if pool else map(case, range(count))
    for result in ongoing:
        results.append(result)
        progress(len(results) / count)
    return results


def _begin_worker() -> None:
    """Keep a worker to one core, as the others have their own, and to the life of its parent."""
    import numba

    numba.set_num_threads(1)
    Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    """End this process when its parent is gone: the workers of a pool would not notice."""
    if (parent := parent_process()) is not None:
        wait([parent.sentinel])
        os._exit(1)
