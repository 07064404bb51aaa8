"""Processes of this machine that share tasks; the task of one that dies is given to another."""

import os
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from multiprocessing import parent_process
from multiprocessing.connection import wait
from typing import Any, Self, TypeVar

from vergence.errors import VergenceError
from vergence.experiments.worker import Worker

Task = TypeVar("Task")
Result = TypeVar("Result")

DEATHS = 3  # of processes over one task, after which it is given up


class DeadlyTaskError(VergenceError):
    """No process survives a task; `number` tells which."""

    def __init__(self, number: int) -> None:
        super().__init__(f"{DEATHS} processes died over task {number}; out of memory?")
        self.number = number


class Workers:
    """Processes that are made when there are tasks, and kept for more until this is left.

    With one worker, and in a worker itself, tasks are done in this process. Ctrl-C is left to this
    process; the others end with it.

    Args:
        count: how many; as many as there are cores if None.

    Attributes:
        count: how many at most do tasks at the same time.
    """

    def __init__(self, count: int | None = None) -> None:
        alone = parent_process() is not None
        self.count = 1 if alone else count or len(os.sched_getaffinity(0))
        self._idle: list[Worker] = []

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        while self._idle:
            self._idle.pop().end()

    def share_out(
        self,
        do: Callable[[Task], Result],
        tasks: Sequence[Task],
        spent: Callable[[float], object] | None = None,
    ) -> Iterator[tuple[int, Result]]:
        """Yield the number of each task with what it comes to, in any order.

        Tasks in hand end with the iterator.

        Args:
            do: a function that can be sent to another process.
            tasks: its arguments.
            spent: told the CPU time that another process took for each task, s.

        Raises:
            DeadlyTaskError: if `DEATHS` processes have died over one task.
        """
        if self.count == 1:
            yield from enumerate(map(do, tasks))
            return
        waiting, deaths = deque(range(len(tasks))), [0] * len(tasks)
        busy: dict[Any, Worker] = {}  # by connection

        def occupy(worker: Worker) -> None:
            number = waiting.popleft()
            worker.give(number, do, tasks[number])
            busy[worker.connection] = worker

        try:
            while waiting or busy:
                while waiting and len(busy) < self.count:
                    occupy(self._idle.pop() if self._idle else Worker.start())
                for connection in wait(list(busy)):
                    worker = busy[connection]
                    number = worker.number
                    try:
                        done = worker.answer()
                    except (EOFError, OSError):
                        del busy[connection]
                        worker.end()
                        deaths[number] += 1
                        if deaths[number] == DEATHS:
                            raise DeadlyTaskError(number) from None
                        waiting.appendleft(number)
                        continue
                    if done is None:
                        continue
                    del busy[connection]
                    if waiting and done.error is None:
                        occupy(worker)
                    else:
                        self._idle.append(worker)
                    if spent is not None:
                        spent(done.cpu_s)
                    if done.error is not None:
                        raise done.error
                    yield number, done.result
        finally:
            for worker in busy.values():
                worker.process.terminate()
            for worker in busy.values():
                worker.end()

    def try_all(
        self,
        case: Callable[[int], Result],
        count: int,
        progress: Callable[[float], object] = lambda _share: None,
    ) -> list[Result]:
        """Return the results of cases 0 … count - 1, in order.

        Args:
            case: a function of the case's number that can be sent to a process.
            count: how many.
            progress: called with the share done.

        Raises:
            DeadlyTaskError: if `DEATHS` processes have died over one case.
        """
        results: dict[int, Result] = {}
        for number, result in self.share_out(case, range(count)):
            results[number] = result
            progress(len(results) / count)
        return [results[number] for number in range(count)]
