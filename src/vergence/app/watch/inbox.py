"""Requests of pages, until the running thread processes them."""

import logging
import queue
from collections.abc import Callable

from vergence.app.watch.commands import Command
from vergence.app.watch.protocol import Request
from vergence.errors import VergenceError

_LOG = logging.getLogger(__name__)
_MOST_WAITING = 256


class Inbox:
    """A queue of requests from one thread to another; refusals are answered to the sender."""

    def __init__(self) -> None:
        self._queue: queue.Queue[Request] = queue.Queue(_MOST_WAITING)

    def ask(self, request: Request) -> None:
        """Add a request; refused at once if too many are waiting."""
        try:
            self._queue.put_nowait(request)
        except queue.Full:
            request.refuse("Too many requests are waiting; this one is dropped.")

    @property
    def empty(self) -> bool:
        """Whether nothing is waiting."""
        return self._queue.empty()

    def obey(self, do: Callable[[Command], None], timeout_s: float) -> None:
        """Do the next thing that is asked for, if one comes in time.

        An endless wait would not hear of a Ctrl-C that the system hands to another thread.

        Args:
            do: does it.
            timeout_s: the longest wait.
        """
        try:
            request = self._queue.get(timeout=timeout_s)
        except queue.Empty:
            return
        try:
            do(request.command)
        except VergenceError as error:
            request.refuse(str(error))
        except Exception as error:  # whatever a page asks for must not end a run
            _LOG.exception("a page asked for %r", request.command)
            request.refuse(f"This failed inside vergence ({type(error).__name__}).")
