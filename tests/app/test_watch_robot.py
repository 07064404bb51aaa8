"""What a page may ask of a cell that runs on a robot: to stop the arm, and nothing else."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from steered import NoScene, Steered, wait

from vergence.app.watch.commands import Grab, Pause, Stop, TurnKnob
from vergence.app.watch.live_robot import LiveRobot
from vergence.app.watch.playback import Playback
from vergence.app.watch.publisher import Publisher
from vergence.app.watch.view_state import Reader, ViewState
from vergence.assembly import run_driver
from vergence.cell import load_cell
from vergence.runtime import DriverWrapper, Recording
from vergence.signals import OutcomeKind, Sample, Setpoint
from vergence.simulation import SimulatedDriver

SMALL = {"cameras.wrist.resolution": "[320, 240]", "cameras.wrist.pixel_um": "[22.0, 26.0]"}


class Robot(DriverWrapper):
    """A cell in simulation, of which only what a driver has is known."""

    speed = 0.0  # that the fastest joint is told, rad/s

    def read(self) -> Sample:
        sample = super().read()
        return replace(sample, frames=tuple(replace(f, truth=None) for f in sample.frames))

    def step(self, setpoints: Mapping[str, Setpoint]) -> None:
        super().step(setpoints)
        for setpoint in setpoints.values():
            Robot.speed = float(np.abs(setpoint.velocity).max())


def test_a_page_stops_the_arm_and_nothing_else(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("vergence.app.watch.live_robot.Scene", NoScene)
    cell = load_cell("puma560", SMALL)
    live = LiveRobot(cell, Robot(SimulatedDriver(cell)), 0.0, tmp_path / "run", 0)
    page, fastest = Steered(live), [0.0]

    def moves() -> bool:
        fastest[0] = max(fastest[0], Robot.speed)
        return float(str(page.status().get("time", 0.0))) > 0.5 and fastest[0] > 0.01

    def steps() -> None:
        wait(moves)
        before = live.view_state.state
        page.ask(Pause(do="pause"))
        page.ask(Grab(do="grab", view="wrist", u=1.0, v=1.0))
        page.ask(TurnKnob(do="knob", key="gain", value=9.0))
        wait(lambda: len(page.refused) == 3)
        wait(lambda: not np.array_equal(live.view_state.state, before))  # it goes on
        page.ask(Stop(do="stop"))
        wait(lambda: page.status().get("outcome"))

    def end() -> None:
        live._stays = False
        if live._loop is not None:
            live._loop.stop()

    run = page.run(steps, end)
    assert run.outcome.kind is OutcomeKind.STOPPED
    assert all(
        text.endswith("allowed: stop; a real arm takes no other command") for text in page.refused
    )
    assert Robot.speed < 1e-9 < fastest[0]  # it was braked
    recorded = Recording.open(tmp_path / "run")
    assert recorded.outcome.kind is OutcomeKind.STOPPED
    assert not Playback(recorded, None).knows_truth


def test_pose_errors_are_by_the_estimate_where_no_truth_is_known() -> None:
    cell = load_cell("four_cameras", {"duration_s": "0.6"})
    driver, states = SimulatedDriver(cell, images=False), (ViewState(), ViewState())
    about = {"images": False}
    publishers = [
        Publisher(state, cell, driver, {**about, "truth": known})
        for state, known in zip(states, (True, False), strict=True)
    ]
    run_driver(cell, driver, publishers, images=False)
    driver.close()
    true, estimated = (state.news(Reader()) for state in states)
    assert true is not None
    assert estimated is not None
    assert true.about is not None
    assert estimated.about is not None
    keys = [[plot["key"] for plot in news.about["plots"]] for news in (true, estimated)]
    assert keys[0][:3] == ["pose_mm", "pose_deg", "target_mm"]
    assert keys[1] == [key for key in keys[0] if key != "target_mm"]
    pairs = zip(true.rows, estimated.rows, strict=True)
    seen = [(a[1:4], b[1:3]) for a, b in pairs if a[1] and a[1][0] is not None]
    assert len(seen) > 10
    for ((by_truth,), _, (target,)), ((by_estimate,), _) in seen:
        assert abs(by_estimate - by_truth) <= target + 0.01  # mm, a triangle's sides
        assert by_estimate != by_truth
