"""Serves the page, and the view state to everyone who has it open."""

import asyncio
import errno
import socket
import threading
from collections.abc import Callable
from importlib.resources import files
from pathlib import Path, PurePosixPath

from websockets.asyncio.server import ServerConnection, serve
from websockets.datastructures import Headers
from websockets.http11 import Request as HttpRequest
from websockets.http11 import Response

from vergence.app.watch.origin_gate import OriginGate
from vergence.app.watch.page_connection import LONGEST_FRAME, PageConnection
from vergence.app.watch.private_listener import PrivateListener
from vergence.app.watch.protocol import Request
from vergence.app.watch.view_state import ViewState
from vergence.errors import InputError

DEFAULT_PORT = 8230
_OTHERS = 20  # ports to try after the default one
_LOOPBACK = frozenset({"localhost", "127.0.0.1", "[::1]"})
_PAGE, _LIVE = "/page/", "/live"
_UPLOAD = "/drop"  # of the viewer, which is to show no other model
_KINDS = {".html": "text/html", ".css": "text/css", ".js": "text/javascript"}
_HEADERS = {
    "Cache-Control": "no-store",
    # Nothing is fetched from anywhere else.
    "Content-Security-Policy": "default-src 'self'; img-src 'self' blob: data:",
}


class Server:
    """Serves on one port, in a thread of its own, until it is closed.

    Args:
        listener: where to listen; see `listen`.
        view_state: what to show.
        ask: is given what pages ask for, in the server's thread.
        scene: the socket of the view in three dimensions; None without one.
        name: under which this machine is called, beside its own names.

    Attributes:
        host: where it listens.
        port: likewise.
    """

    def __init__(
        self,
        listener: socket.socket,
        view_state: ViewState,
        ask: Callable[[Request], None],
        scene: Path | None,
        name: str = "",
    ) -> None:
        self._listener, self._view_state, self._ask = listener, view_state, ask
        self._scene, self._name = scene, name
        host, port, *_ = listener.getsockname()
        self.host, self.port = str(host), int(port)
        self._loop = asyncio.new_event_loop()
        self._ending = asyncio.Event()
        self._pages = PrivateListener()
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
        """Close every connection."""
        self._loop.call_soon_threadsafe(self._ending.set)
        self._thread.join(timeout=5.0)
        self._pages.close()

    def _run(self) -> None:
        self._loop.run_until_complete(self._serve())
        self._loop.close()

    async def _serve(self) -> None:
        pages = await serve(
            self._serve_page,
            sock=self._pages.socket,
            process_request=self._answer,
            compression=None,
            max_size=LONGEST_FRAME,
        )
        gate = OriginGate(self._route, self._names(), any_address=not self.only_here)
        async with pages, await asyncio.start_server(gate.serve, sock=self._listener):
            await self._ending.wait()
            await gate.close()

    def _names(self) -> frozenset[str]:
        """Return under which names this machine is called."""
        if self.only_here:
            return _LOOPBACK
        own = socket.gethostname()
        names = {self._name, own, f"{own}.local", socket.getfqdn()}
        return _LOOPBACK | {name.lower() for name in names if name}

    def _route(self, path: str) -> Path | None:
        if path in ("/", _LIVE) or path.startswith(_PAGE):
            return self._pages.path
        return None if path == _UPLOAD or not path.startswith("/") else self._scene

    def _answer(self, connection: ServerConnection, request: HttpRequest) -> Response | None:
        """Answer a request for a file of the page; None opens a page's connection."""
        path = request.path.partition("?")[0]
        if path == _LIVE:
            return None
        name = "index.html" if path == "/" else path.removeprefix(_PAGE)
        file = files("vergence.app.watch") / "page" / PurePosixPath(name).name
        suffix = PurePosixPath(file.name).suffix
        if suffix not in _KINDS or not file.is_file():
            return connection.respond(404, "There is no such page.\n")
        body = file.read_bytes()
        kind = _KINDS[suffix] + "; charset=utf-8"
        length = str(len(body))
        headers = Headers({**_HEADERS, "Content-Type": kind, "Content-Length": length})
        return Response(200, "OK", headers, body)

    async def _serve_page(self, connection: ServerConnection) -> None:
        await PageConnection(connection, self._view_state, self._ask).serve()


def listen(host: str, port: int | None) -> socket.socket:
    """Return a socket that listens.

    Args:
        host: a name or address of this machine.
        port: None for the first free one from `DEFAULT_PORT` on, 0 for any.

    Raises:
        InputError: if it cannot be had.
    """
    allowed = "127.0.0.1, or another address of this machine"
    if not host:  # which would mean every address
        raise InputError("vergence watch", "--host", host, allowed)
    ports = range(DEFAULT_PORT, DEFAULT_PORT + _OTHERS) if port is None else (port,)
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    for number in ports:
        try:
            return socket.create_server((host, number), family=family)
        except (OSError, UnicodeError) as error:
            if getattr(error, "errno", None) not in (errno.EADDRINUSE, errno.EACCES):
                raise InputError("vergence watch", "--host", host, allowed) from None
    given = f"{ports[0]} … {ports[-1]}" if port is None else port
    raise InputError("vergence watch", "--port", given, "a port that is free and that you may use")
