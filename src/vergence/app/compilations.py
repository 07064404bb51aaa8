"""Counts the kernels that a command compiles and may still have to, and the time that takes."""

import sys
import time
from collections.abc import Callable
from types import TracebackType
from typing import Any, Self

from vergence.kernels.compiled import COMPILED_IN_WORKER, is_kept

COMPILING, USUALLY = "compiling kernels, once on this computer", "usually within two minutes"
_KINDS = ("numba:compile", COMPILED_IN_WORKER)


class Compilations:
    """Tells each time a kernel is compiled, here or in a worker process, how far that is.

    Args:
        told: is called with it in words.
    """

    def __init__(self, told: Callable[[str], None] | None = None) -> None:
        from numba.core import event

        class Listener(event.Listener):  # type: ignore[misc]
            count = nested = 0  # a kernel's callees are compiled within it
            began = spent = 0.0

            def __init__(self, words: Callable[[], str]) -> None:
                self.words = words
                self.in_workers: set[str] = set()  # names: several may compile the same

            def on_start(self, begun: Any) -> None:
                self.began = self.began if self.nested else time.perf_counter()
                self.nested += 1
                if begun.kind == COMPILED_IN_WORKER:
                    self.in_workers.add(begun.data)
                else:
                    self.count += 1
                if told is not None:
                    told(self.words())

            def on_end(self, ended: Any) -> None:
                self.nested -= 1
                self.spent += 0.0 if self.nested else time.perf_counter() - self.began

        self._event: Any = event
        self._listener = Listener(self.words)

    @property
    def count(self) -> int:
        """How many kernels have been compiled or are at the moment, by this process."""
        return self._listener.count

    @property
    def under_way(self) -> bool:
        """Whether a kernel is being compiled."""
        return self._listener.nested > 0

    @property
    def spent_s(self) -> float:
        """How long compiling has taken, s."""
        listener = self._listener
        now = time.perf_counter() - listener.began if listener.nested else 0.0
        return listener.spent + now

    def words(self) -> str:
        """Return what is compiled, how long that usually takes, and how many of how many at most.

        Every kernel of the imported modules that is not kept may have to be compiled. Which of them
        a run calls is not known before it calls them, so there may be far fewer: of the first run
        on a computer a good third. What worker processes import is not known here.
        """
        if self._listener.in_workers:
            return f"{COMPILING}, {USUALLY}: {len(self._listener.in_workers)} so far in the workers"
        return f"{COMPILING}, {USUALLY}: {self.count} of at most {self.count + _not_compiled()}"

    def __enter__(self) -> Self:
        for kind in _KINDS:
            self._event.register(kind, self._listener)
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        for heard in _KINDS:
            self._event.unregister(heard, self._listener)


def _not_compiled() -> int:
    """Return how many kernels of the modules imported so far are neither compiled nor kept."""
    from numba.core.dispatcher import Dispatcher

    modules = [module for name, module in [*sys.modules.items()] if name.startswith("vergence.")]
    values = (value for module in modules for value in [*vars(module).values()])
    kernels = {id(value): value for value in values if isinstance(value, Dispatcher)}
    return sum(not kernel.overloads and not is_kept(kernel) for kernel in kernels.values())
