"""`vergence watch`: open a page on a running cell or on a recording."""

import os
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from vergence.app.output import SUCCESS, emit, new_folder, say, warn

if TYPE_CHECKING:
    from vergence.app.watch.server import Server


class Request(NamedTuple):
    """What the command line asks for."""

    source: str  # a cell, or a run folder
    out: Path | None
    seed: int | None
    images: bool
    image_every: int
    settings: Sequence[str]
    host: str
    port: int | None
    browser: bool
    as_json: bool


def watch(request: Request) -> int:
    """Serve the page until Ctrl-C; return the exit code."""
    emitted = _watch_cell(request)
    if request.as_json:
        emit({"command": "watch", **emitted})
    return SUCCESS


def _watch_cell(request: Request) -> Mapping[str, object]:
    from vergence.app.progress import working
    from vergence.app.run import overrides
    from vergence.app.watch.law_desk import LawDesk
    from vergence.app.watch.live import Live
    from vergence.app.watch.server import Server

    desk = LawDesk(request.source, overrides(request.settings), request.seed)
    out = request.out or new_folder(desk.cell.name)
    with working("setting up the cell"):
        live = Live(desk, request.images, out, request.image_every)
    try:
        server = Server(request.host, request.port, live.board, live.ask, live.scene.port)
        live.scene.start()
        server.start()
        _invite(server, request)
        try:
            outcome = live.run().outcome
            end = {"kind": outcome.kind.value, "reason": outcome.reason, "time": outcome.time}
        except KeyboardInterrupt:  # outside of the loop, which ends a run by itself
            end = {"kind": "stopped", "reason": "stopped by the user", "time": 0.0}
        server.close()
    finally:
        live.close()
    _say(f"stopped; see `vergence report {live.folder}` for what was recorded", request)
    return {"cell": desk.cell.name, "address": server.address, "run": live.folder, "outcome": end}


def _invite(server: "Server", request: Request) -> None:
    """Say where the page is and who can reach it; open it where there is a screen."""
    from vergence.app.watch.server import is_loopback

    _say(f"watch at  {server.address}   (Ctrl-C stops)", request)
    if is_loopback(server.host):
        _say("Only this machine can reach it; --host opens it to others.", request)
    else:
        warn(
            f"It listens on {server.host}: whoever reaches that can watch and steer, unasked and "
            f"unencrypted. Safer: `ssh -L {server.port}:localhost:{server.port} THIS-MACHINE`."
        )
    if request.browser and _has_screen():
        import webbrowser

        webbrowser.open(server.address)


def _has_screen() -> bool:
    screens = ("DISPLAY", "WAYLAND_DISPLAY")
    return sys.platform != "linux" or any(os.environ.get(screen) for screen in screens)


def _say(text: str, request: Request) -> None:
    """Write a line for a person: on stderr if stdout is for one JSON object."""
    (warn if request.as_json else say)(text)
    sys.stdout.flush()
