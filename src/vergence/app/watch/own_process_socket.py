"""A loopback port for two parts of this process that can only talk over TCP."""

import socket
from typing import Any, Self


class OwnProcessSocket(socket.socket):
    """Listens on 127.0.0.1 and accepts connections of this process alone.

    MuJoCo's viewer connects to its web server by the number of a TCP port. Web pages and other
    users reach such a port too; theirs are closed before a byte is read.
    """

    @classmethod
    def listening(cls) -> Self:
        """Return a socket that listens on a free port."""
        listener = cls(socket.AF_INET, socket.SOCK_STREAM)
        listener.bind(("127.0.0.1", 0))
        listener.listen()
        return listener

    def accept(self) -> tuple[socket.socket, Any]:
        """Return the next connection of this process, and its address."""
        while True:
            connection, address = super().accept()
            if _is_ours(address):
                return connection, address
            connection.close()


def _is_ours(address: tuple[str, int]) -> bool:
    """Whether a socket of this process has that address at its own end."""
    import psutil

    return any(each.laddr == address for each in psutil.Process().net_connections("tcp4"))
