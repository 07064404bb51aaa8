"""What a page asks of a running cell, without a browser: nothing that it asks ends the command."""

from pathlib import Path

import pytest
from steered import NoScene, Steered, wait

from vergence.app.watch.commands import Pause, Reset, TrackPoints
from vergence.app.watch.law_editor import LawEditor
from vergence.app.watch.live import Live
from vergence.signals import OutcomeKind

SMALL = {
    "cameras.wrist.resolution": "[320, 240]",
    "cameras.wrist.pixel_um": "[22.0, 26.0]",
    "target.motion": '{ kind = "stationary" }',
}


def test_points_that_cannot_be_tracked_are_refused_and_a_reset_takes_up_the_cells_own_task(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("vergence.app.watch.live.Scene", NoScene)
    live = Live(LawEditor("puma560", SMALL, None), True, tmp_path / "run", 0)
    page, frames, passed = Steered(live), live._newest.frames, list[str]()

    def steps() -> None:
        wait(lambda: "wrist" in frames)
        page.ask(Pause(do="pause"))
        wait(lambda: page.status().get("paused"))
        twice = [(160.0, 120.0), (160.0, 120.0)]
        page.ask(TrackPoints(do="track", time=frames["wrist"].time, points=twice))
        wait(lambda: (page.status().get("outcome") or {}).get("kind") == "points refused")
        passed.append("refused")
        frames.clear()
        page.ask(Reset(do="reset"))
        wait(lambda: "wrist" in frames and not page.status().get("outcome"))
        passed.append("own task")

    def end() -> None:
        live._again = False
        wait(lambda: live._loop is not None)
        live._loop.stop()

    run = page.run(steps, end)
    assert passed == ["refused", "own task"]
    assert page.refused == []
    assert run.outcome.kind is OutcomeKind.STOPPED
    assert run.cameras["wrist"].points_px.shape[1] == 1
