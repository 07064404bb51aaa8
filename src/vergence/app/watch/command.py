"""`vergence watch`: open a page on a running cell or on a recording."""

import os
import sys
from collections.abc import Mapping
from contextlib import closing, suppress
from pathlib import Path
from typing import TYPE_CHECKING

from vergence.app.output import SUCCESS, emit, run_folder, say, warn
from vergence.errors import Absent, InputError
from vergence.optional_package import optional_package
from vergence.places import RECORDING, find_recording

if TYPE_CHECKING:
    from socket import socket

    from vergence.app.options import WatchOptions
    from vergence.app.watch.live import Live
    from vergence.app.watch.live_robot import LiveRobot
    from vergence.app.watch.server import Server
    from vergence.runtime import Recording


def watch(options: "WatchOptions") -> int:
    """Serve the page until Ctrl-C; return the exit code.

    Raises:
        InputError: if what is asked for cannot be shown, or the page's packages are not installed.
    """
    for module in ("websockets", "psutil"):
        optional_package("the live page", module, "watch", "vergence watch")
    from vergence.runtime.bags import is_bag

    bag = is_bag(options.source)
    if options.topic is not None and not bag:
        raise InputError("vergence watch", "--topic", options.topic, "only with a ROS 2 bag")
    recording = Path(options.source) if bag else _recording_in(Path(options.source))
    answer = _watch_cell(options) if recording is None else _watch_recording(options, recording)
    if options.as_json:
        emit({"command": "watch", **answer})
    return SUCCESS


def _recording_in(path: Path) -> Path | None:
    """Return the recording that a path means, if it means one: a run folder has a cell, too."""
    if path.suffix == Path(RECORDING).suffix:
        return find_recording(path)
    return path / RECORDING if (path / RECORDING).is_file() else None


def _watch_recording(options: "WatchOptions", path: Path) -> Mapping[str, object]:
    for option, given in (
        ("--set", options.settings),
        ("--out", options.out),
        ("--seed", options.seed),
        ("--driver", options.driver),
    ):
        if given is not None:
            raise InputError(
                "vergence watch", option, given, "only with a cell; a recording cannot be changed"
            )
    from vergence.app.progress import working
    from vergence.app.watch.replay import Replay
    from vergence.app.watch.server import Server, listen

    with listen(options.host, options.port) as listener:
        with working("reading the recording"):
            replay = Replay(_opened(path, options.topic))
        with closing(replay):
            scene = replay.scene.path if replay.scene is not None else None
            server = Server(listener, replay.view_state, replay.ask, scene, options.host)
            with closing(server), suppress(KeyboardInterrupt):
                _invite(server, options)
                replay.run()
    return {"run": path if path.is_dir() else path.parent, "address": server.address}


def _opened(path: Path, topic: str | None) -> "Recording":
    """Return a recording of ours, or what a bag has of one."""
    from vergence.runtime.bags import is_bag, read_bag
    from vergence.runtime.recording import Recording

    return read_bag(path, topic) if is_bag(path) else Recording.open(path)


def _watch_cell(options: "WatchOptions") -> Mapping[str, object]:
    from vergence.app.run import overrides
    from vergence.cell import load_cell

    settings = overrides(options.settings)
    load_cell(options.source, settings, options.seed)  # report mistakes before loading everything
    if options.driver is not None:
        return _watch_robot(options, settings)
    from vergence.app.progress import working
    from vergence.app.watch.law_editor import LawEditor
    from vergence.app.watch.live import Live
    from vergence.app.watch.server import listen

    editor = LawEditor(options.source, settings, options.seed)
    out = run_folder(options.out, options.overwrite, editor.cell.name)
    with listen(options.host, options.port) as listener:
        with working("setting up the cell", editor.cell.name):
            live = Live(editor, options.images, out, options.image_every)
        address, end = _serve(live, listener, options)
    _say(f"recorded: `vergence watch {live.folder}` shows it again", options)
    return {"cell": editor.cell.name, "address": address, "run": live.folder, "outcome": end}


def _watch_robot(options: "WatchOptions", settings: Mapping[str, str]) -> Mapping[str, object]:
    """Run a cell on a robot."""
    if not options.images:
        raise InputError("vergence watch", "--no-images", Absent("images"), "images with --driver")
    from vergence.app.progress import working
    from vergence.app.watch.live_robot import LiveRobot
    from vergence.app.watch.server import listen
    from vergence.assembly import check_driver, open_driver, rehearse, servo_lag_s
    from vergence.cell import load_cell

    named = str(options.driver)
    cell = load_cell(options.source, settings, options.seed)
    check_driver(cell, named)
    out = run_folder(options.out, options.overwrite, cell.name)
    with listen(options.host, options.port) as listener:
        with working("rehearsing in simulation", cell.name):
            rehearse(cell)
        driver = open_driver(cell, named)
        try:
            lag_s = servo_lag_s(cell, named)
            live = LiveRobot(cell, driver, lag_s, out, options.image_every)
        except BaseException:
            driver.close()
            raise
        address, end = _serve(live, listener, options)
    _say(f"recorded: `vergence report {live.folder}` writes the report", options)
    return {"cell": cell.name, "address": address, "run": live.folder, "outcome": end}


def _serve(
    live: "Live | LiveRobot", listener: "socket", options: "WatchOptions"
) -> tuple[str, Mapping[str, object]]:
    """Serve the page while the cell runs; return its address and how the run ended."""
    from vergence.app.watch.server import Server

    with closing(live):
        scene = live.scene.path
        server = Server(listener, live.view_state, live.ask, scene, options.host)
        with closing(server):
            return server.address, _end(live, server, options)


def _end(
    live: "Live | LiveRobot", server: "Server", options: "WatchOptions"
) -> Mapping[str, object]:
    """Run until Ctrl-C; return how it ended."""
    try:
        _invite(server, options)
        outcome = live.run().outcome
    except KeyboardInterrupt:  # outside of the loop, which ends a run by itself
        return {"kind": "stopped", "reason": "stopped by the user", "time": 0.0}
    return {"kind": outcome.kind.value, "reason": outcome.reason, "time": outcome.time}


def _invite(server: "Server", options: "WatchOptions") -> None:
    """Return where the page is and who can reach it; open it where there is a screen."""
    _say(f"watch at  {server.address}   (Ctrl-C stops)", options)
    if server.only_here:
        _say("Only this machine can reach it; --host opens it to others.", options)
    else:
        warn(
            f"It listens on {server.host}: anyone who reaches it can watch and control the run, "
            "without password or encryption. Safer: "
            f"`ssh -L {server.port}:localhost:{server.port} THIS-MACHINE`."
        )
    if options.browser and _has_screen():
        import webbrowser

        webbrowser.open(server.address)


def _has_screen() -> bool:
    screens = ("DISPLAY", "WAYLAND_DISPLAY")
    return sys.platform != "linux" or any(os.environ.get(screen) for screen in screens)


def _say(text: str, options: "WatchOptions") -> None:
    """Write a line for a person: on stderr if stdout is for one JSON object."""
    (warn if options.as_json else say)(text)
    sys.stdout.flush()
