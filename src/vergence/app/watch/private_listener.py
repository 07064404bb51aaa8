"""A listening socket that no web page and no other user can reach."""

import socket
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Self

_LONGEST_FOLDER = 80  # characters: the kernel takes 107 for the whole path


class PrivateListener:
    """A Unix socket in a folder that only this user can enter.

    A browser can be made to call any TCP port of the machine that it runs on; it cannot call this.

    Attributes:
        socket: bound, for a server to listen on.
        path: for those who connect.
    """

    def __init__(self) -> None:
        self._folder = TemporaryDirectory(prefix="vergence-", ignore_cleanup_errors=True)
        if len(self._folder.name) > _LONGEST_FOLDER:
            self._folder.cleanup()
            self._folder = TemporaryDirectory(
                prefix="vergence-", dir="/tmp", ignore_cleanup_errors=True
            )
        self.path = Path(self._folder.name) / "socket"
        self.socket = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        self.socket.bind(str(self.path))

    def close(self) -> None:
        """Remove the socket and its folder."""
        self.socket.close()
        self._folder.cleanup()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: Any) -> None:
        self.close()
