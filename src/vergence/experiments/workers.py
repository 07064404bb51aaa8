"""Processes of this machine that share tasks; the task of one that dies is given to another."""

import logging
import signal
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from multiprocessing import get_context
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from time import process_time
from typing import Any, TypeVar

Task = TypeVar("Task")
Result = TypeVar("Result")

DEATHS = 3  # of processes over one task, after which it is given up
_END_S = 5.0  # that a process has to end by itself
# Most of what a run needs, imported once for all processes. Not MuJoCo: it opens an EGL display,
# and drivers of graphics cards do not survive that a process is copied.
IMPORTED = (
    "vergence.planning",
    "vergence.runtime",
    "vergence.estimation.object_follower",
)


class DeadlyTaskError(Exception):
    """No process survives a task; `number` tells which."""

    def __init__(self, number: int) -> None:
        super().__init__(f"{DEATHS} processes died over task {number}")
        self.number = number


def share_out(
    do: Callable[[Task], Result],
    tasks: Sequence[Task],
    count: int,
    spent: Callable[[float], object] | None = None,
) -> Iterator[Result]:
    """Yield what tasks come to, in any order.

    Processes share what was imported before they were made, and are kept while there are tasks.
    Ctrl-C is left to this process; the others end with it, and with the iterator.

    Args:
        do: a function that can be sent to another process.
        tasks: its arguments.
        count: how many processes at most.
        spent: told the CPU time of each task, s.

    Raises:
        DeadlyTaskError: if `DEATHS` processes have died over one task.
    """
    waiting, deaths = deque(range(len(tasks))), [0] * len(tasks)
    workers: dict[Any, _Worker] = {}  # by connection
    try:
        while waiting or workers:
            while waiting and len(workers) < count:
                worker = _Worker.start(do)
                workers[worker.connection] = worker
                worker.give(waiting[0], tasks[waiting.popleft()])
            for connection in wait(list(workers)):
                worker = workers[connection]
                try:
                    error, result, cpu_s = worker.connection.recv()
                except (EOFError, OSError):
                    workers.pop(connection).end()
                    deaths[worker.number] += 1
                    if deaths[worker.number] == DEATHS:
                        raise DeadlyTaskError(worker.number) from None
                    waiting.appendleft(worker.number)
                    continue
                if spent is not None:
                    spent(cpu_s)
                if error is not None:
                    raise error
                if waiting:
                    worker.give(waiting[0], tasks[waiting.popleft()])
                else:
                    workers.pop(connection).end()
                yield result
    finally:
        for worker in workers.values():
            worker.process.terminate()
        for worker in workers.values():
            worker.end()


@dataclass(slots=True)
class _Worker:
    process: BaseProcess
    connection: "Connection[Any, Any]"
    number: int = -1  # of its task

    @classmethod
    def start(cls, do: Callable[[Any], Any]) -> "_Worker":
        context = get_context("forkserver")
        context.set_forkserver_preload(list(IMPORTED))
        ours, theirs = context.Pipe()
        process = context.Process(target=_work, args=(do, theirs), daemon=True)
        before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})  # they inherit this
        try:
            process.start()
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)
            theirs.close()
        return cls(process, ours)

    def give(self, number: int, task: Any) -> None:
        self.number = number
        with suppress(OSError):  # of one that has died, which is found out when it should answer
            self.connection.send(task)

    def end(self) -> None:
        self.connection.close()  # upon which an idle one ends
        self.process.join(_END_S)
        if self.process.is_alive():
            self.process.kill()
            self.process.join()
        self.process.close()


def _work(do: Callable[[Any], Any], connection: "Connection[Any, Any]") -> None:
    """Do tasks until the other process closes the connection or is gone."""
    logging.getLogger("vergence").setLevel(logging.ERROR)  # that process warns, too, and once
    signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    while True:
        try:
            task = connection.recv()
        except (EOFError, OSError):
            return
        error, result, began_s = None, None, process_time()
        try:
            result = do(task)
        except KeyboardInterrupt:  # terminated amid a run
            return
        except Exception as raised:
            error = raised
        with suppress(OSError):
            connection.send((error, result, process_time() - began_s))
