"""`vergence watch`: open a page on a running cell or on a recording."""

import os
import sys
from collections.abc import Mapping, Sequence
from contextlib import closing, suppress
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from vergence.app.output import SUCCESS, emit, new_folder, say, warn
from vergence.errors import InputError
from vergence.optional_package import optional_package
from vergence.places import RECORDING, find_recording

if TYPE_CHECKING:
    from vergence.app.watch.live import Live
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
    """Serve the page until Ctrl-C; return the exit code.

    Raises:
        InputError: if what is asked for cannot be shown, or the page's packages are not installed.
    """
    for module in ("websockets", "psutil"):
        optional_package("the live page", module, "watch", "vergence watch")
    recording = _recording_in(Path(request.source))
    answer = _watch_cell(request) if recording is None else _watch_recording(request, recording)
    if request.as_json:
        emit({"command": "watch", **answer})
    return SUCCESS


def _recording_in(path: Path) -> Path | None:
    """Return the recording that a path means, if it means one: a run folder has a cell, too."""
    if path.suffix == Path(RECORDING).suffix:
        return find_recording(path)
    return path / RECORDING if (path / RECORDING).is_file() else None


def _watch_recording(request: Request, path: Path) -> Mapping[str, object]:
    for option, given in (
        ("--set", request.settings),
        ("--out", request.out),
        ("--seed", request.seed),
    ):
        if given not in (None, ()):
            raise InputError("watch", option, given, "nothing: a recording is only shown")
    from vergence.app.progress import working
    from vergence.app.watch.replay import Replay
    from vergence.app.watch.server import Server, listen
    from vergence.runtime import Recording

    with listen(request.host, request.port) as listener:
        with working("reading the recording"):
            replay = Replay(Recording.open(path))
        with closing(replay):
            scene = replay.scene.path if replay.scene is not None else None
            server = Server(listener, replay.view_state, replay.ask, scene, request.host)
            with closing(server), suppress(KeyboardInterrupt):
                _invite(server, request)
                replay.run()
    return {"run": path.parent, "address": server.address}


def _watch_cell(request: Request) -> Mapping[str, object]:
    from vergence.app.run import overrides
    from vergence.cell import load_cell

    settings = overrides(request.settings)
    load_cell(request.source, settings, request.seed)  # a mistake is told before all is loaded
    from vergence.app.progress import working
    from vergence.app.watch.law_editor import LawEditor
    from vergence.app.watch.live import Live
    from vergence.app.watch.server import Server, listen

    editor = LawEditor(request.source, settings, request.seed)
    out = request.out or new_folder(editor.cell.name)
    with listen(request.host, request.port) as listener:
        with working("setting up the cell"):
            live = Live(editor, request.images, out, request.image_every)
        with closing(live):
            scene = live.scene.path
            server = Server(listener, live.view_state, live.ask, scene, request.host)
            with closing(server):
                end = _end(live, server, request)
    _say(f"recorded: `vergence watch {live.folder}` shows it again", request)
    return {"cell": editor.cell.name, "address": server.address, "run": live.folder, "outcome": end}


def _end(live: "Live", server: "Server", request: Request) -> Mapping[str, object]:
    """Run until Ctrl-C; return how it ended."""
    try:
        _invite(server, request)
        outcome = live.run().outcome
    except KeyboardInterrupt:  # outside of the loop, which ends a run by itself
        return {"kind": "stopped", "reason": "stopped by the user", "time": 0.0}
    return {"kind": outcome.kind.value, "reason": outcome.reason, "time": outcome.time}


def _invite(server: "Server", request: Request) -> None:
    """Say where the page is and who can reach it; open it where there is a screen."""
    _say(f"watch at  {server.address}   (Ctrl-C stops)", request)
    if server.only_here:
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
