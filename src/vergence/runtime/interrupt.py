"""Signals that end a run, handled only at a safe point of the loop."""

import signal
from time import monotonic
from types import FrameType, TracebackType
from typing import Any, Self

_SIGNALS = tuple(
    getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)
)
_BRAKING_S = 2.0  # a second Ctrl-C within this time is taken for the first one


class Interrupt:
    """While entered, only records SIGINT (Ctrl-C), SIGTERM and SIGHUP, so that the loop can brake.

    A Ctrl-C two seconds or more after the first signal interrupts as usual, in case the driver
    hangs. Signals that the process ignores remain ignored. Outside the main thread, where Python
    delivers no signals, nothing is recorded.
    """

    def __init__(self) -> None:
        self.asked = False  # whether the run should end
        self.reason = "stopped by the user"
        self._since = 0.0
        self._before: dict[int, Any] = {}

    def __enter__(self) -> Self:
        for number in _SIGNALS:
            if signal.getsignal(number) is signal.SIG_IGN:
                continue
            try:
                self._before[number] = signal.signal(number, self._note)
            except ValueError:  # not the main thread
                break
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        while self._before:
            signal.signal(*self._before.popitem())

    def _note(self, number: int, frame: FrameType | None) -> None:
        if number == signal.SIGINT and self.asked and monotonic() - self._since > _BRAKING_S:
            raise KeyboardInterrupt
        if not self.asked:
            self._since = monotonic()
            if number != signal.SIGINT:
                self.reason = f"stopped by {signal.Signals(number).name}"
        self.asked = True
