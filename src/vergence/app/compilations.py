"""Counts the kernels that a command compiles, and the time that takes."""

import time
from collections.abc import Callable
from types import TracebackType
from typing import Any, Self

COMPILING = "compiling kernels, once on this computer"


class Compilations:
    """Tells each time a kernel is compiled how many have been so far.

    Args:
        told: is called with the count.
    """

    def __init__(self, told: Callable[[int], None] | None = None) -> None:
        from numba.core import event

        class Listener(event.Listener):  # type: ignore[misc]
            count = nested = 0  # a kernel's callees are compiled within it
            began = spent = 0.0

            def on_start(self, begun: Any) -> None:
                self.began = self.began if self.nested else time.perf_counter()
                self.nested += 1
                self.count += 1
                if told is not None:
                    told(self.count)

            def on_end(self, ended: Any) -> None:
                self.nested -= 1
                self.spent += 0.0 if self.nested else time.perf_counter() - self.began

        self._event: Any = event
        self._listener = Listener()

    @property
    def count(self) -> int:
        """How many kernels have been compiled or are at the moment."""
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

    def __enter__(self) -> Self:
        self._event.register("numba:compile", self._listener)
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self._event.unregister("numba:compile", self._listener)
