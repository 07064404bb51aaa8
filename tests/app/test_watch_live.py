"""What a page asks of a running cell, without a browser: nothing that it asks ends the command."""

import signal
import threading
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from steered import NoScene, Steered, wait

from vergence.app.watch.commands import (
    Grab,
    Move,
    Pause,
    Release,
    Reset,
    TrackPoints,
    TurnKnob,
)
from vergence.app.watch.law_editor import LawEditor
from vergence.app.watch.live import Live
from vergence.app.watch.protocol import Request
from vergence.assembly import LawContext
from vergence.assembly.started_driver import StartedDriver
from vergence.errors import InputError
from vergence.signals import OutcomeKind
from vergence.simulation import SimulatedDriver

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


def test_a_run_that_has_ended_refuses_a_drag_and_a_wrong_value_by_its_key(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("vergence.app.watch.live.Scene", NoScene)
    live = Live(LawEditor("puma560", SMALL, None), False, tmp_path / "run", 0)
    page = Steered(live)

    def steps() -> None:
        wait(lambda: live._loop is not None)
        page.ask(TurnKnob(do="knob", key="Q", value=0.0))
        page.ask(TurnKnob(do="knob", key="solver.singular_below", value=9.9))
        wait(lambda: page.status().get("outcome"))
        page.ask(Grab(do="grab", view="", u=0.0, v=0.0))
        page.ask(Move(do="move", view="", u=0.1, v=0.0, along=False))
        page.ask(Release(do="release"))
        wait(lambda: len(page.refused) == 2)

    def end() -> None:
        live._again = True
        wait(lambda: live._loop is not None)
        live._loop.stop()
        live._again = False

    page.run(steps, end)
    assert page.refused == [
        "law.Q: given 0.0; allowed: greater than 0",
        "The run has ended; Restart begins another.",
    ]


def test_a_ctrl_c_that_another_thread_takes_ends_the_rest_after_a_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("vergence.app.watch.live.Scene", NoScene)
    live = Live(LawEditor("puma560", SMALL, None), False, tmp_path / "run", 0)
    live._again = False
    late: list[str] = []

    def press() -> None:
        time.sleep(0.3)
        signal.pthread_kill(threading.get_ident(), signal.SIGINT)

    def rescue() -> None:
        late.append("still at rest")
        live._again = True
        live.ask(Request(Pause(do="pause"), late.append))

    timer = threading.Timer(10.0, rescue)
    timer.start()
    threading.Thread(target=press).start()
    live._rest()
    timer.cancel()
    live.close()
    assert late == []


def test_a_switch_that_the_law_does_not_take_is_not_offered() -> None:
    editor = LawEditor("puma560", SMALL, None)
    driver = SimulatedDriver(editor.cell, images=False)
    started = LawContext.of(editor.stage, StartedDriver(driver, ("wrist",)))
    context = replace(started, points_px={"wrist": np.array([[160.0, 120.0]])})
    editor.offer(context)
    assert {"prediction", "S"} <= {knob["key"] for knob in editor.as_json()["knobs"]}
    assert "feed_forward" not in {knob["key"] for knob in editor.as_json()["knobs"]}
    editor.choose("image_based", context)  # feeds no motion forward, since the depth is held
    editor.offer(context)
    keys = {knob["key"] for knob in editor.as_json()["knobs"]}
    assert "gain" in keys
    assert "flow_smoothing_s" not in keys
    editor.choose("optimal_tracking (as in the cell)", context)
    with pytest.raises(InputError, match="a wrong depth looks like motion"):
        editor.turn("feed_forward", True, context)
    driver.close()


TRACK = 'kind = "track", arm = "puma", camera = "wrist"'
TASKS = SMALL | {
    "law": '{ kind = "image_based" }',
    "target.features": "[[0.05, 0.05, 0], [-0.05, 0.05, 0], [-0.05, -0.05, 0], [0.05, -0.05, 0]]",
    "law.gain": "0.5",
    "laws": '{ second = { kind = "image_based", gain = 1.0 } }',
    "tasks": f"""[
        {{ {TRACK}, until = {{ kind = "time", time_s = 0.2 }} }},
        {{ kind = "advance", arm = "puma", camera = "wrist", distance_m = 0.002 }},
        {{ {TRACK}, law = "second", until = {{ kind = "time", time_s = 0.2 }} }},
        {{ {TRACK} }},
    ]""",
}


def test_the_law_of_the_task_that_runs_is_changed_and_tasks_that_share_it_share_the_change() -> (
    None
):
    editor = LawEditor("puma560", TASKS, None)
    driver = SimulatedDriver(editor.cell, images=False)
    contexts = [
        LawContext.of(stage, StartedDriver(driver, ("wrist",))) for stage in editor.cell.stages
    ]
    begun, changed = editor.cell, {}
    for number, gain in ((0, 0.25), (2, 2.0)):
        editor.begin_task(number)
        points = {"wrist": driver.first_frame("wrist").truth.points_px}
        contexts[number] = contexts[number].with_points(points)
        editor.turn("gain", gain, contexts[number])
        changed[number] = editor.as_json()["settings"]
    assert changed == {0: ["law.gain=0.25"], 2: ["law.gain=0.25", "laws.second.gain=2.0"]}
    gains = [stage.law.objective.gain for stage in editor.cell.stages]
    assert gains == [0.25, 0.25, 2.0, 0.25]
    editor.begin_task(3)
    assert editor.law_after(begun, contexts[0]) is not None
    assert editor.law_after(editor.cell, contexts[0]) is None
    editor.choose("second", contexts[0])  # what another task goes by
    assert editor.as_json()["settings"][0] == "laws.second.gain=2.0"
    editor.reset(contexts[0])  # the changes of all tasks
    assert editor.as_json()["settings"] == []
    assert editor.as_json()["choice"] == "image_based (as in the cell)"
    assert [stage.law.objective.gain for stage in editor.cell.stages] == [0.5, 0.5, 1.0, 0.5]
    editor.begin_task(1)
    assert not editor.as_json()["choices"]
    with pytest.raises(InputError, match="uses no law"):
        editor.turn("gain", 1.0, contexts[1])
    driver.close()


def test_a_number_turned_in_one_task_acts_in_a_later_one_by_the_same_law(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("vergence.app.watch.live.Scene", NoScene)
    live = Live(
        LawEditor("puma560", TASKS, None),
        False, tmp_path / "run", 0,
    )  # fmt: skip
    page, changes = Steered(live), list[tuple[int, str]]()
    monkeypatch.setattr(live, "_say", lambda name, text: changes.append((live._task, text)))

    def steps() -> None:
        wait(lambda: live._loop is not None)
        page.ask(TurnKnob(do="knob", key="gain", value=0.125))
        wait(lambda: len(changes) == 2)

    def end() -> None:
        live._again = False
        live._loop.stop()

    page.run(steps, end)
    assert page.refused == []
    assert changes == [(0, "law.gain=0.125"), (3, "law.gain=0.125")]
    assert live._loop is None
