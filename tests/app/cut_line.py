"""A line to a server that can be cut: a proxy."""

import contextlib
import socket
import threading
from typing import Self


class CutLine:
    """Relays connections to a port of this machine, until they are cut.

    Attributes:
        port: where it listens.
        open: whether it takes connections.
    """

    def __init__(self, to_port: int) -> None:
        self._to_port = to_port
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.port = int(self._listener.getsockname()[1])
        self.open = True
        self._sockets: list[tuple[str, socket.socket]] = []  # with the path asked for
        threading.Thread(target=self._listen, daemon=True).start()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self._listener.close()
        self.cut()

    @property
    def address(self) -> str:
        return f"http://localhost:{self.port}/"

    def cut(self, path: str = "") -> int:
        """Cut all connections, or those that asked for a path; return how many."""
        cut = [item for item in self._sockets if item[0].startswith(path)]
        for item in cut:
            self._sockets.remove(item)
            with contextlib.suppress(OSError):
                item[1].shutdown(socket.SHUT_RDWR)
        return len(cut)

    def _listen(self) -> None:
        with contextlib.suppress(OSError):
            while True:
                threading.Thread(
                    target=self._serve, args=(self._listener.accept()[0],), daemon=True
                ).start()

    def _serve(self, near: socket.socket) -> None:
        with contextlib.suppress(OSError), near:
            if not self.open:
                return
            head = near.recv(1 << 16)
            path = head.decode("latin-1").split(" ")[1] if head else ""
            with socket.create_connection(("127.0.0.1", self._to_port)) as far:
                self._sockets += [(path, near), (path, far)]
                far.sendall(head)
                back = threading.Thread(target=_copy, args=(far, near), daemon=True)
                back.start()
                _copy(near, far)
                back.join()


def _copy(source: socket.socket, to: socket.socket) -> None:
    with contextlib.suppress(OSError):
        while data := source.recv(1 << 16):
            to.sendall(data)
    with contextlib.suppress(OSError):
        to.shutdown(socket.SHUT_RDWR)
