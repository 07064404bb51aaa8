"""The one port that browsers reach: two servers behind it, and a look at who is calling."""

import asyncio
import contextlib
from collections.abc import Callable

_REFUSED = b"HTTP/1.1 403 Forbidden\r\nContent-Length: 0\r\nConnection: close\r\n\r\n"
_CHUNK = 1 << 16
_PATIENCE_S = 10.0  # for the head of a request


class Door:
    """Hands each connection, by the path it asks for, to a server on a loopback port.

    A page of another site may make a browser call here; it is turned away by what the browser says
    of itself: the page's origin, and the name it called this host by.

    Args:
        way: the port behind the door for a path.
        hosts: names that this host may be called by; any if empty.
    """

    def __init__(self, way: Callable[[str], int], hosts: frozenset[str]) -> None:
        self._way, self._hosts = way, hosts
        self._inside: set[asyncio.Task[None]] = set()

    async def enter(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        """Let a connection in, until it is closed on either side."""
        visit = asyncio.create_task(self._visit(reader, writer))
        self._inside.add(visit)
        visit.add_done_callback(self._inside.discard)
        with contextlib.suppress(asyncio.CancelledError):
            await visit

    async def close(self) -> None:
        """Put everyone out."""
        for visit in self._inside:
            visit.cancel()
        await asyncio.gather(*self._inside, return_exceptions=True)

    async def _visit(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        try:
            async with asyncio.timeout(_PATIENCE_S):
                head = await reader.readuntil(b"\r\n\r\n")
            path, headers = _parse(head)
            if self._welcome(headers):
                await self._through(self._way(path), head, reader, writer)
            else:
                writer.write(_REFUSED)
                await writer.drain()
        except (OSError, asyncio.IncompleteReadError, asyncio.LimitOverrunError):
            pass  # gone, or no browser
        finally:
            writer.close()

    def _welcome(self, headers: dict[str, str]) -> bool:
        host, origin = headers.get("host", ""), headers.get("origin")
        if origin is not None and origin.partition("://")[2] != host:
            return False
        return not self._hosts or _without_port(host) in self._hosts

    async def _through(
        self, port: int, head: bytes, reader: asyncio.StreamReader, writer: asyncio.StreamWriter
    ) -> None:
        inner_reader, inner_writer = await asyncio.open_connection("127.0.0.1", port)
        inner_writer.write(head)
        ways = {
            asyncio.create_task(_pump(reader, inner_writer)),
            asyncio.create_task(_pump(inner_reader, writer)),
        }
        try:
            await asyncio.wait(ways, return_when=asyncio.FIRST_COMPLETED)
        finally:
            for way in ways:
                way.cancel()
            inner_writer.close()


async def _pump(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
    with contextlib.suppress(OSError):
        while data := await reader.read(_CHUNK):
            writer.write(data)
            await writer.drain()


def _parse(head: bytes) -> tuple[str, dict[str, str]]:
    """Return the path and the headers, names in small letters, of a request's head."""
    request, *lines = head.decode("latin-1").split("\r\n")
    words = request.split(" ")
    headers = (line.partition(":") for line in lines if line)
    path = words[1].partition("?")[0] if len(words) > 1 else "/"
    return path, {name.strip().lower(): value.strip() for name, _, value in headers}


def _without_port(host: str) -> str:
    name, colon, port = host.rpartition(":")
    return name if colon and port.isdigit() else host
