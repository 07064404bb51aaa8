"""What a page asks of a running cell, without a browser: nothing that it asks ends the command."""

import threading
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from vergence.app.watch.commands import Command, Pause, Reset, TrackPoints
from vergence.app.watch.law_editor import LawEditor
from vergence.app.watch.live import Live
from vergence.app.watch.protocol import Request
from vergence.app.watch.view_state import Reader
from vergence.app.watch.viewer_camera import ViewerCamera
from vergence.signals import OutcomeKind

SMALL = {
    "cameras.wrist.resolution": "[320, 240]",
    "cameras.wrist.pixel_um": "[22.0, 26.0]",
    "target.motion": '{ kind = "stationary" }',
}
PATIENCE_S = 120.0


def wait(until: Callable[[], object]) -> None:
    end = time.monotonic() + PATIENCE_S
    while not until():
        assert time.monotonic() < end
        time.sleep(0.02)


class NoScene:
    """In place of the view in three dimensions, which listens in threads of its own."""

    viewer_camera = ViewerCamera.around(np.zeros(3), 2.0, 90.0, -20.0, 45.0)

    def __init__(self, world: object, view_state: object) -> None:
        pass

    def close(self) -> None:
        pass


def test_points_that_cannot_be_tracked_are_refused_and_a_reset_takes_up_the_cells_own_task(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("vergence.app.watch.live.Scene", NoScene)
    live = Live(LawEditor("puma560", SMALL, None), True, tmp_path / "run", 0)
    frames, refused, passed = live._newest.frames, list[str](), list[str]()

    def ask(command: Command) -> None:
        live.ask(Request(command, refused.append))

    def status() -> dict[str, object]:
        news = live.view_state.news(Reader())
        return {} if news is None else dict(news.status)

    def steer() -> None:
        try:
            wait(lambda: "wrist" in frames)
            ask(Pause(do="pause"))
            wait(lambda: status().get("paused"))
            twice = [(160.0, 120.0), (160.0, 120.0)]
            ask(TrackPoints(do="track", time=frames["wrist"].time, points=twice))
            wait(lambda: (status().get("outcome") or {}).get("kind") == "points refused")
            passed.append("refused")
            frames.clear()
            ask(Reset(do="reset"))
            wait(lambda: "wrist" in frames and not status().get("outcome"))
            passed.append("own task")
        finally:
            live._again = False
            wait(lambda: live._loop is not None)
            live._loop.stop()

    steering = threading.Thread(target=steer)
    steering.start()
    try:
        run = live.run()
    finally:
        steering.join()
        live.close()
    assert passed == ["refused", "own task"]
    assert refused == []
    assert run.outcome.kind is OutcomeKind.STOPPED
    assert run.cameras["wrist"].points_px.shape[1] == 1
