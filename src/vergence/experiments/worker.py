"""A process of this machine that does tasks which another one gives it."""

import logging
import os
import signal
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from multiprocessing import get_context, parent_process
from multiprocessing.connection import Connection, wait
from multiprocessing.forkserver import ensure_running
from multiprocessing.process import BaseProcess
from threading import Thread
from time import process_time
from typing import Any, NamedTuple

from vergence.kernels.compiled import COMPILED_IN_WORKER

_END_S = 5.0  # that a process has to end by itself
# Most of what a run needs, imported once for all processes. Not MuJoCo: it opens an EGL display,
# and drivers of graphics cards do not survive that a process is copied.
IMPORTED = (
    "vergence.planning",
    "vergence.runtime",
    "vergence.estimation.known_object.object_follower",
)


class Done(NamedTuple):
    """What came of a task."""

    error: Exception | None
    result: Any
    cpu_s: float  # that it took


@dataclass(slots=True)
class Worker:
    """One process: it shares what was imported before it was made, and ends with its parent."""

    process: BaseProcess
    connection: "Connection[Any, Any]"
    number: int = -1  # of its task
    compiles: list[str] = field(default_factory=list)  # the kernel in hand, and those it calls

    @classmethod
    def start(cls) -> "Worker":
        """Start a process, which Ctrl-C does not reach."""
        context = get_context("forkserver")
        ours, theirs = context.Pipe()
        process = context.Process(target=_work, args=(theirs,), daemon=True)
        prepare_workers()
        try:
            with _sigint_blocked():
                process.start()
        finally:
            theirs.close()
        return cls(process, ours)

    def give(self, number: int, do: Callable[[Any], Any], task: Any) -> None:
        """Let it do a task: call a function that can be sent to it, with an argument."""
        self.number = number
        with suppress(OSError):  # of one that has died, which is found out when it should answer
            self.connection.send((do, task))

    def answer(self) -> Done | None:
        """Return what came of its task; None if it only tells of a kernel that it compiles.

        Those become events of numba in this process, of a kind of their own, for progress bars.

        Raises:
            EOFError: if it has died.
            OSError: likewise.
        """
        told = self.connection.recv()
        if isinstance(told, Done):
            return told
        if told:
            self.compiles.append(told)
            _events().start_event(COMPILED_IN_WORKER, data=told)
        else:
            self._end_compiling()
        return None

    def _end_compiling(self) -> None:
        while self.compiles:
            _events().end_event(COMPILED_IN_WORKER, data=self.compiles.pop())

    def end(self) -> None:
        """Wait until it has ended; an idle one does so by itself."""
        self._end_compiling()
        self.connection.close()
        self.process.join(_END_S)
        if self.process.is_alive():
            self.process.kill()
            self.process.join()
        self.process.close()


def prepare_workers() -> None:
    """Begin to import what all processes share, in the one that they are copied from, if need be.

    Returns at once, while the first `Worker.start` waits until that is done: about a second.
    """
    get_context("forkserver").set_forkserver_preload(list(IMPORTED))
    with _sigint_blocked():
        ensure_running()


@contextmanager
def _sigint_blocked() -> Iterator[None]:
    """Let processes that are started meanwhile not be reached by Ctrl-C: they inherit this."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _work(connection: "Connection[Any, Any]") -> None:
    """Do tasks until the other process closes the connection or is gone."""
    import numba

    # That process warns, too, and once; results say what a part raised.
    logging.getLogger("vergence").setLevel(logging.CRITICAL)
    signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    numba.set_num_threads(1)  # the other cores are those of other processes
    Thread(target=_end_with_parent, daemon=True).start()
    _tell_compilations(connection)
    while True:
        try:
            do, task = connection.recv()
        except (EOFError, OSError):
            return
        error, result, began_s = None, None, process_time()
        try:
            result = do(task)
        except KeyboardInterrupt:  # terminated amid a run
            return
        except Exception as raised:
            raised.add_note(f"In a process of its own:\n{traceback.format_exc()}")
            error = raised
        with suppress(OSError):
            connection.send(Done(error, result, process_time() - began_s))


def _tell_compilations(connection: "Connection[Any, Any]") -> None:
    """Send the name of each kernel that is compiled from now on, and "" when no more are."""

    class Listener(_events().Listener):  # type: ignore[misc]
        nested = 0  # a kernel's callees are compiled within it

        def on_start(self, begun: Any) -> None:
            function = begun.data["dispatcher"].py_func
            self.tell(f"{function.__module__}.{function.__qualname__}")
            self.nested += 1

        def on_end(self, ended: Any) -> None:
            self.nested -= 1
            if self.nested == 0:
                self.tell("")

        def tell(self, kernel: str) -> None:
            with suppress(OSError):
                connection.send(kernel)

    _events().register("numba:compile", Listener())


def _events() -> Any:
    """Return numba's module of events, which has no types."""
    from numba.core import event

    return event


def _end_with_parent() -> None:
    """End this process when its parent is gone, whatever it does."""
    if (parent := parent_process()) is not None:
        wait([parent.sentinel])
        os._exit(1)
