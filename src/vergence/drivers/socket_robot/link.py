"""Messages over a socket, each behind its length. Nothing here waits longer than it is told to."""

import select
import socket
import struct
from collections.abc import Sequence
from time import monotonic, sleep

from vergence.errors import DriverSilent

_LENGTH = struct.Struct("!I")
_CHUNK = 1 << 16
# select waits to the microsecond, where poll rounds up to milliseconds, but it only takes
# descriptors below this: a process with many files and sockets has others.
_SELECT_BELOW = 1024


class LinkBrokenError(Exception):
    """The other side hung up, or sent something that is not a message; the text says which."""

    refused = False  # whether it is the other side that says so


class Link:
    """One end of a connection.

    Args:
        connection: to the other end.
        longest: of the messages that are accepted, bytes.
    """

    def __init__(self, connection: socket.socket, longest: int) -> None:
        connection.setblocking(False)
        if connection.family != socket.AF_UNIX:
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
                raise LinkBrokenError(f"closed the connection ({error.strerror})") from error
            if not data:
                raise LinkBrokenError("closed the connection")
            self._received += data
        return message

    def send(self, messages: Sequence[bytes], timeout_s: float) -> None:
        """Send messages; one that is not taken in time breaks the link."""
        deadline = monotonic() + timeout_s
        left = memoryview(b"".join(_LENGTH.pack(len(each)) + each for each in messages))
        while left:
            try:
                left = left[self._connection.send(left) :]
            except BlockingIOError:
                if not self._ready(deadline, reading=False):
                    raise LinkBrokenError(f"has read nothing for {timeout_s:g} s") from None
            except OSError as error:
                raise LinkBrokenError(f"closed the connection ({error.strerror})") from error

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
        this = self._connection.fileno()
        if this < 0:  # closed by another thread
            raise LinkBrokenError("is closed")
        left_s = max(deadline - monotonic(), 0.0)
        try:
            if this >= _SELECT_BELOW:
                poll = select.poll()
                poll.register(this, select.POLLIN if reading else select.POLLOUT)
                return bool(poll.poll(1e3 * left_s))
            ready = select.select([this] * reading, [this] * (not reading), [], left_s)
        except OSError as error:
            raise LinkBrokenError("is closed") from error
        return any(ready)


def connect(address: tuple[str, int], longest: int, within_s: float = 30.0) -> Link:
    """Return the link to a robot that may still be starting.

    Raises:
        DriverSilent: if nobody listens there in time.
    """
    until = monotonic() + within_s
    while True:
        try:
            return Link(socket.create_connection(address, within_s), longest)
        except OSError as error:
            if monotonic() > until:
                host, port = address
                reason = error.strerror or "no answer"
                raise DriverSilent(f"no robot answers at {host}:{port} ({reason})") from error
            sleep(0.1)
