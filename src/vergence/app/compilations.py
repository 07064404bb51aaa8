"""Counts the kernels that are compiled while a command prepares itself."""

from collections.abc import Callable
from types import TracebackType
from typing import Any, Self


class Compilations:
    """Tells each time a kernel is compiled how many have been so far.

    Args:
        told: is given the count.
    """

    def __init__(self, told: Callable[[int], None]) -> None:
        from numba.core import event

        class Listener(event.Listener):  # type: ignore[misc]
            count = 0

            def on_start(self, begun: Any) -> None:
                self.count += 1
                told(self.count)

            def on_end(self, ended: Any) -> None: ...

        self._event: Any = event
        self._listener = Listener()

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
