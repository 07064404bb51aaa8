"""Who may move the robot: one client at a time; the others are told who does."""

import socket
from collections.abc import Callable
from queue import Empty, SimpleQueue
from threading import Thread

from vergence.drivers.socket_robot import Link, LinkBrokenError, decode, encode

HELLO_TIMEOUT_S = 1.0
_LONGEST = 1 << 16  # bytes of a message of a client: set-points of many arms


class Clients:
    """Waits for clients in a thread of its own, so that the servo never waits for one.

    A client begins with its name; the robot answers whether it is served, or who is.

    Args:
        listener: a socket that listens.
    """

    def __init__(self, listener: socket.socket) -> None:
        self._listener = listener
        self._next: SimpleQueue[tuple[str, Link]] = SimpleQueue()
        self._served = ""
        Thread(target=self._greet, daemon=True).start()

    def wait(self, stopped: Callable[[], bool] = lambda: False) -> tuple[str, Link]:
        """Return the name of the next client, and the link to it."""
        while not stopped():
            try:
                return self._next.get(timeout=0.1)
            except Empty:
                continue
        raise LinkBrokenError("is not waited for any more")

    def dismiss(self) -> None:
        """Let another client be served."""
        self._served = ""

    def _greet(self) -> None:
        while True:
            try:
                connection, _ = self._listener.accept()
            except OSError:  # closed
                return
            link = Link(connection, _LONGEST)
            try:
                self._answer(link)
            except LinkBrokenError:
                link.close()

    def _answer(self, link: Link) -> None:
        hello = link.receive(HELLO_TIMEOUT_S)
        name = decode(hello).get("client") if hello is not None else None
        if not isinstance(name, str) or not 0 < len(name) <= 100:
            raise LinkBrokenError("does not say who it is")
        if self._served:
            reason = f"it serves {self._served}; one client at a time"
            link.send([encode({"refused": reason})], HELLO_TIMEOUT_S)
            link.close()
            return
        self._served = name
        self._next.put((name, link))
