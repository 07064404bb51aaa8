"""Progress where no terminal shows it: a line on stderr after a second, then every ten."""

import sys
import threading
from collections.abc import Callable
from types import TracebackType
from typing import Self

FIRST_S, PERIOD_S = 1.0, 10.0


class Heartbeat:
    """Writes a line after a second and then every ten until it is stopped.

    It writes nothing if stderr is a terminal.

    Args:
        line: what there is to say at the moment; called in a thread of its own.
    """

    def __init__(self, line: Callable[[], str]) -> None:
        self._line, self._ended = line, threading.Event()
        self._thread: threading.Thread | None = None

    def start(self) -> None:
        """Begin, if there is no terminal."""
        if self._thread is None and not sys.stderr.isatty():
            self._thread = threading.Thread(target=self._beat, name="heartbeat", daemon=True)
            self._thread.start()

    def stop(self) -> None:
        """End; a second call does nothing."""
        self._ended.set()

    def __enter__(self) -> Self:
        self.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.stop()

    def _beat(self) -> None:
        wait_s = FIRST_S
        while not self._ended.wait(wait_s):
            print(self._line(), file=sys.stderr, flush=True)
            wait_s = PERIOD_S
