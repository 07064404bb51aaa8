"""The one port that browsers reach: it refuses other sites' pages, and relays the rest."""

import asyncio
import contextlib
from collections.abc import Callable, Collection
from ipaddress import ip_address
from pathlib import Path

Headers = dict[str, list[str]]  # by name in small letters

_ONLY_OWN_PAGES = (
    "vergence watch answers only its own page, opened under a name or address it was started with."
)
_NO_SUCH_PAGE = "There is no such page."
_BUSY = "Too many connections are open."
_CHUNK = 1 << 16
_HEAD_TIMEOUT_S = 10.0
_MOST_CONNECTIONS = 128  # a browser opens about ten


class OriginGate:
    """Relays each connection, by the path it asks for, to a server behind a Unix socket.

    A web page can make its visitor's browser call any port of the visitor's machine. The browser
    says which page called (`Origin`) and under which name (`Host`); a call of another site's page,
    or under a name that another site may have pointed here, gets 403.

    Args:
        route: the socket of the server for a path; None if there is no such path.
        hosts: names under which this machine is called, in small letters.
        any_address: whether it may be called by any address, too: other sites cannot take an
            address, as they can a name.
    """

    def __init__(
        self, route: Callable[[str], Path | None], hosts: Collection[str], any_address: bool
    ) -> None:
        self._route, self._hosts, self._any_address = route, frozenset(hosts), any_address
        self._open: set[asyncio.Task[None]] = set()

    async def serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        """Serve a connection until either side closes it."""
        if len(self._open) >= _MOST_CONNECTIONS:
            await _refuse(writer, "503 Service Unavailable", _BUSY)
            return
        connection = asyncio.create_task(self._check(reader, writer))
        self._open.add(connection)
        connection.add_done_callback(self._open.discard)
        with contextlib.suppress(asyncio.CancelledError):
            await connection

    async def close(self) -> None:
        """Cancel open connections."""
        for connection in self._open:
            connection.cancel()
        await asyncio.gather(*self._open, return_exceptions=True)

    async def _check(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        try:
            async with asyncio.timeout(_HEAD_TIMEOUT_S):
                head = await reader.readuntil(b"\r\n\r\n")
            path, headers = _parse(head)
            server = self._route(path)
            if not self._allows(headers):
                await _refuse(writer, "403 Forbidden", _ONLY_OWN_PAGES)
            elif server is None:
                await _refuse(writer, "404 Not Found", _NO_SUCH_PAGE)
            else:
                await _relay(server, head, reader, writer)
        except (OSError, asyncio.IncompleteReadError, asyncio.LimitOverrunError):
            pass  # gone, or no browser
        finally:
            writer.close()

    def _allows(self, headers: Headers) -> bool:
        hosts, origins = headers.get("host", []), headers.get("origin", [])
        if len(hosts) != 1 or len(origins) > 1:
            return False
        if origins and origins[0].lower().partition("://")[2] != hosts[0].lower():
            return False
        name = _without_port(hosts[0].lower())
        return name in self._hosts or (self._any_address and _is_address(name))


async def _relay(
    server: Path, head: bytes, reader: asyncio.StreamReader, writer: asyncio.StreamWriter
) -> None:
    inner_reader, inner_writer = await asyncio.open_unix_connection(server)
    inner_writer.write(head)
    directions = {
        asyncio.create_task(_copy(reader, inner_writer)),
        asyncio.create_task(_copy(inner_reader, writer)),
    }
    try:
        await asyncio.wait(directions, return_when=asyncio.FIRST_COMPLETED)
    finally:
        for direction in directions:
            direction.cancel()
        inner_writer.close()


async def _copy(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
    with contextlib.suppress(OSError):
        while data := await reader.read(_CHUNK):
            writer.write(data)
            await writer.drain()


async def _refuse(writer: asyncio.StreamWriter, status: str, reason: str) -> None:
    body = f"{reason}\n".encode()
    head = (
        f"HTTP/1.1 {status}\r\nContent-Type: text/plain; charset=utf-8\r\n"
        f"Content-Length: {len(body)}\r\nConnection: close\r\n\r\n"
    )
    with contextlib.suppress(OSError):
        writer.write(head.encode() + body)
        await writer.drain()
    writer.close()


def _parse(head: bytes) -> tuple[str, Headers]:
    """Return the path and the headers of a request's head."""
    request, *lines = head.decode("latin-1").split("\r\n")
    words = request.split(" ")
    headers: Headers = {}
    for line in filter(None, lines):
        name, _, value = line.partition(":")
        headers.setdefault(name.strip().lower(), []).append(value.strip())
    return words[1].partition("?")[0] if len(words) > 1 else "", headers


def _without_port(host: str) -> str:
    name, colon, port = host.rpartition(":")
    return name if colon and port.isdigit() else host


def _is_address(name: str) -> bool:
    try:
        ip_address(name.removeprefix("[").removesuffix("]"))
    except ValueError:
        return False
    return True
