"""Combines several listeners, none of which can end a run."""

import logging
from collections.abc import Callable, Mapping, Sequence

from vergence.raised import raised
from vergence.runtime.listener import Listener
from vergence.runtime.run_info import RunInfo
from vergence.runtime.tick import TickRecord
from vergence.signals import Outcome

_LOG = logging.getLogger(__name__)


class Listeners:
    """Notifies every listener; one that raises is dropped, and the others are informed.

    The loop continues when a disk is full or a page was closed. A dropped listener is still closed,
    so that it can finish what it has.

    Args:
        listeners: in the order in which they are notified.
    """

    def __init__(self, listeners: Sequence[Listener]) -> None:
        self._all = tuple(listeners)
        self._active = list(listeners)

    def begin(self, info: RunInfo) -> None:
        """Announce the run; nothing moves yet, so exceptions propagate."""
        for listener in self._all:
            listener.begin(info)

    def tick(self, record: TickRecord) -> None:
        """Report one turn of the loop."""
        self._tell(record.time, lambda listener: listener.tick(record))

    def event(self, time: float, name: str, text: str) -> None:
        """Report an event."""
        self._tell(time, lambda listener: listener.event(time, name, text))

    def close(self, outcome: Outcome, summary: Mapping[str, float | str]) -> None:
        """Announce the end to every listener, even if another one raises."""
        for listener in self._all:
            try:
                listener.close(outcome, summary)
            except Exception as error:
                _LOG.exception("%s could not be closed: %s", type(listener).__name__, error)

    def _tell(self, time: float, tell: Callable[[Listener], None]) -> None:
        for listener in tuple(self._active):
            try:
                tell(listener)
            except Exception as error:
                _LOG.exception("%s is dropped", type(listener).__name__)
                self._active.remove(listener)
                text = f"{type(listener).__name__} raised {raised(error)}"
                self.event(time, "listener dropped", text)
