"""What every bridge's main program does before and after its own work."""

import os
import signal
import socket
import sys
from collections.abc import Callable
from typing import Any, TypeVar

from .wire import Wire

_Library = TypeVar("_Library")


def serve(
    descriptor: int,
    load: Callable[[], _Library],
    work: Callable[[Wire, dict[str, Any], _Library], None],
) -> None:
    """Take the settings, load the library, work, and end the process.

    Args:
        descriptor: of the socket to whoever started the bridge.
        load: imports what needs the library; if that cannot be, the other end is told why.
        work: is given the connection, the settings and what was loaded.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the other end's; it brakes the arm
    wire = Wire(socket.socket(fileno=descriptor))
    if (settings := wire.receive()) is None:
        return
    try:
        library = load()
    except (ImportError, ValueError) as error:  # ValueError: PyGObject without the library
        wire.send({"cannot": str(error)})
        return
    work(wire, settings, library)
    sys.stderr.flush()
    os._exit(0)  # the library's threads end with it; they may be waiting for what is gone
