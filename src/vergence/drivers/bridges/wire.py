"""Messages over a socket, each behind its length: the other end of `socket_robot.Link`."""

import json
import socket
import struct
from collections.abc import Iterable
from threading import Lock
from typing import Any

_LENGTH = struct.Struct("!I")


class Wire:
    """The bridge's end of the connection to the driver.

    Args:
        connection: to the driver.
    """

    def __init__(self, connection: socket.socket) -> None:
        self._connection, self._stream = connection, connection.makefile("rb")
        self._sending = Lock()

    def send(self, words: dict[str, Any], blocks: Iterable[bytes] = ()) -> None:
        """Send words, and blocks of bytes behind them; the driver may be gone."""
        with self._sending:
            try:
                for message in (json.dumps(words).encode(), *blocks):
                    self._connection.sendall(_LENGTH.pack(len(message)))
                    self._connection.sendall(message)
            except OSError:
                pass  # whoever receives notices

    def receive(self) -> dict[str, Any] | None:
        """Wait for the next words; None if the driver has hung up."""
        try:
            head = self._stream.read(_LENGTH.size)
            if len(head) < _LENGTH.size:
                return None
            (length,) = _LENGTH.unpack(head)
            words: dict[str, Any] = json.loads(self._stream.read(length))
        except (OSError, ValueError):
            return None
        return words
