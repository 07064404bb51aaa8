"""Messages over a socket, each behind its length. Nothing here waits longer than it is told to."""

import json
import select
import socket
import struct
from collections.abc import Sequence
from time import monotonic
from typing import Any

_LENGTH = struct.Struct("!I")
_CHUNK = 1 << 16


class LinkBrokenError(Exception):
    """The other side has hung up, or sends what is no message; the text says which."""


class Link:
    """One end of a connection.

    Args:
        connection: to the other end.
        longest: of the messages that are accepted, bytes.
    """

    def __init__(self, connection: socket.socket, longest: int) -> None:
        connection.setblocking(False)
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._connection, self._longest = connection, longest
        self._received = bytearray()

    def receive(self, timeout_s: float) -> bytes | None:
        """Return the next message; None if it is not there, to its last byte, in time."""
        deadline = monotonic() + timeout_s
        while (message := self._next()) is None:
            if not self._ready(deadline, reading=True):
                return None
            try:
                data = self._connection.recv(_CHUNK)
            except OSError as error:
                raise LinkBrokenError(f"has hung up ({error.strerror})") from error
            if not data:
                raise LinkBrokenError("has hung up")
            self._received += data
        return message

    def send(self, messages: Sequence[bytes], timeout_s: float) -> None:
        """Send messages; one that is not taken in time breaks the link."""
        deadline = monotonic() + timeout_s
        left = memoryview(b"".join(_LENGTH.pack(len(each)) + each for each in messages))
        while left:
            if not self._ready(deadline, reading=False):
                raise LinkBrokenError(f"has read nothing for {timeout_s:g} s")
            try:
                left = left[self._connection.send(left) :]
            except OSError as error:
                raise LinkBrokenError(f"has hung up ({error.strerror})") from error

    def close(self) -> None:
        """Hang up."""
        self._connection.close()

    def _next(self) -> bytes | None:
        """Return the first of the messages that are here already."""
        if len(self._received) < _LENGTH.size:
            return None
        (length,) = _LENGTH.unpack_from(self._received)
        if length > self._longest:
            raise LinkBrokenError(f"sends a message of {length} bytes")
        end = _LENGTH.size + length
        if len(self._received) < end:
            return None
        message = bytes(self._received[_LENGTH.size : end])
        del self._received[:end]
        return message

    def _ready(self, deadline: float, reading: bool) -> bool:
        this = [self._connection]
        left = max(deadline - monotonic(), 0.0)
        try:
            readable, writable, _ = select.select(this * reading, this * (not reading), [], left)
        except (OSError, ValueError) as error:  # closed by another thread
            raise LinkBrokenError("is closed") from error
        return bool(readable or writable)


def encode(words: dict[str, Any]) -> bytes:
    """Return a message of JSON."""
    return json.dumps(words, allow_nan=False).encode()


def decode(message: bytes) -> dict[str, Any]:
    """Return what a message of JSON says."""
    try:
        words = json.loads(message)
    except (ValueError, RecursionError):
        raise LinkBrokenError("sends what is no message") from None
    if not isinstance(words, dict):
        raise LinkBrokenError("sends what is no message")
    return words


def vector(values: Any, length: int) -> list[float]:
    """Return so many numbers that came over a link."""
    numbers = isinstance(values, list) and len(values) == length
    if not numbers or not all(type(v) in (int, float) and -1e9 < v < 1e9 for v in values):
        raise LinkBrokenError(f"sends something else than {length} numbers")
    return [float(value) for value in values]
