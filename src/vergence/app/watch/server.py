"""Serves the page, and what is on the board to everyone who has it open."""

import asyncio
import errno
import json
import socket
import threading
from collections.abc import Callable, Mapping
from importlib.resources import files
from pathlib import PurePosixPath
from typing import Any

from websockets.asyncio.server import ServerConnection, serve
from websockets.datastructures import Headers
from websockets.exceptions import ConnectionClosed
from websockets.http11 import Request, Response

from vergence.app.watch.board import Board, Reader
from vergence.app.watch.door import Door
from vergence.app.watch.wire import packed
from vergence.errors import InputError

DEFAULT_PORT = 8230
_OTHERS = 20  # ports to try after the default one
_LOOPBACK = frozenset({"localhost", "127.0.0.1", "[::1]"})
_PAGE, _LIVE = "/page/", "/live"
_PERIOD_S = 1 / 40  # between two looks at the board
_LONGEST_COMMAND = 1 << 12  # bytes
_KINDS = {".html": "text/html", ".css": "text/css", ".js": "text/javascript"}
_HEADERS = {
    "Cache-Control": "no-store",
    # Nothing is fetched from anywhere else.
    "Content-Security-Policy": "default-src 'self'; img-src 'self' blob: data:",
}


class Server:
    """Serves on one port, in a thread of its own, until it is closed.

    Args:
        door: where to listen; see `listen`.
        board: what to show.
        ask: is given what pages ask for, in the server's thread.
        scene_port: of the view in three dimensions, on loopback; None without one.

    Attributes:
        host: where it listens.
        port: likewise.
    """

    def __init__(
        self,
        door: socket.socket,
        board: Board,
        ask: Callable[[Mapping[str, Any]], None],
        scene_port: int | None,
    ) -> None:
        self._socket, self._board, self._ask = door, board, ask
        self._scene_port = scene_port
        host, port, *_ = door.getsockname()
        self.host, self.port = str(host), int(port)
        self._loop = asyncio.new_event_loop()
        self._ending = asyncio.Event()
        self._inner_port = 0
        self._thread = threading.Thread(target=self._run, name="pages", daemon=True)
        self._thread.start()

    @property
    def address(self) -> str:
        """What to open in a browser on this machine."""
        here = self.only_here or self.host in ("0.0.0.0", "::")
        name = f"[{self.host}]" if ":" in self.host else self.host
        return f"http://{'localhost' if here else name}:{self.port}/"

    @property
    def only_here(self) -> bool:
        """Whether no other machine reaches it."""
        return self.host.startswith("127.") or self.host == "::1"

    def close(self) -> None:
        """Hang up on everyone."""
        self._loop.call_soon_threadsafe(self._ending.set)
        self._thread.join(timeout=5.0)

    def _run(self) -> None:
        self._loop.run_until_complete(self._serve())
        self._loop.close()

    async def _serve(self) -> None:
        inner = await serve(
            self._tell,
            "127.0.0.1",
            0,
            process_request=self._answer,
            compression=None,
            max_size=_LONGEST_COMMAND,
        )
        self._inner_port = next(iter(inner.sockets)).getsockname()[1]
        door = Door(self._way, _LOOPBACK if self.only_here else frozenset())
        async with inner, await asyncio.start_server(door.enter, sock=self._socket):
            await self._ending.wait()
            await door.close()

    def _way(self, path: str) -> int:
        ours = path in ("/", _LIVE) or path.startswith(_PAGE)
        return self._inner_port if ours or self._scene_port is None else self._scene_port

    def _answer(self, connection: ServerConnection, request: Request) -> Response | None:
        """Answer a request for a file of the page; None lets a page open its line."""
        path = request.path.partition("?")[0]
        if path == _LIVE:
            return None
        name = "index.html" if path == "/" else path.removeprefix(_PAGE)
        file = files("vergence.app.watch") / "page" / PurePosixPath(name).name
        if not file.is_file():
            return connection.respond(404, "There is no such page.\n")
        body = file.read_bytes()
        kind = _KINDS[PurePosixPath(file.name).suffix] + "; charset=utf-8"
        length = str(len(body))
        headers = Headers({**_HEADERS, "Content-Type": kind, "Content-Length": length})
        return Response(200, "OK", headers, body)

    async def _tell(self, line: ServerConnection) -> None:
        """Tell a page what is new, and pass on what it asks, until it is closed.

        A page is told more when it says that it has shown the last: a slow one misses pictures, but
        never lags behind.
        """
        ready = asyncio.Event()
        ready.set()
        asking = asyncio.create_task(self._listen(line, ready))
        reader = Reader()
        try:
            while not asking.done():
                news = self._board.news(reader) if ready.is_set() else None
                if news is not None:
                    ready.clear()
                    await line.send(packed(news))
                await asyncio.sleep(_PERIOD_S)
        except ConnectionClosed:
            pass
        finally:
            asking.cancel()

    async def _listen(self, line: ServerConnection, ready: asyncio.Event) -> None:
        async for text in line:
            try:
                command = json.loads(text)
            except ValueError:
                continue
            if command == {"do": "more"}:
                ready.set()
            elif isinstance(command, dict):
                self._ask(command)


def listen(host: str, port: int | None) -> socket.socket:
    """Return a socket that listens.

    Args:
        host: a name or address of this machine.
        port: None for the first free one from `DEFAULT_PORT` on, 0 for any.

    Raises:
        InputError: if it cannot be had.
    """
    ports = range(DEFAULT_PORT, DEFAULT_PORT + _OTHERS) if port is None else (port,)
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    for number in ports:
        try:
            return socket.create_server((host, number), family=family)
        except OSError as error:
            if error.errno not in (errno.EADDRINUSE, errno.EACCES):
                allowed = "127.0.0.1, or another address of this machine"
                raise InputError("watch", "--host", host, allowed) from None
    given = f"{ports[0]} … {ports[-1]}" if port is None else port
    raise InputError("watch", "--port", given, "a port that is free and that you may use")
