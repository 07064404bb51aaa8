"""What a page may ask of a cell that runs on a robot: to stop the arm, and nothing else."""

import threading
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest
from test_watch_live import NoScene, wait

from vergence.app.watch.commands import Command, Grab, Pause, Stop, TurnKnob
from vergence.app.watch.live_robot import LiveRobot
from vergence.app.watch.protocol import Request
from vergence.app.watch.view_state import Reader
from vergence.cell import load_cell
from vergence.runtime import DriverWrapper, Recording
from vergence.signals import OutcomeKind, Setpoint
from vergence.simulation import SimulatedDriver

SMALL = {"cameras.wrist.resolution": "[320, 240]", "cameras.wrist.pixel_um": "[22.0, 26.0]"}


class Robot(DriverWrapper):
    """A cell in simulation, of which only what a driver has is known."""

    speed = 0.0  # that the fastest joint is told, rad/s

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
    refused, fastest = list[str](), [0.0]

    def ask(command: Command) -> None:
        live.ask(Request(command, refused.append))

    def status() -> dict[str, object]:
        news = live.view_state.news(Reader())
        return {} if news is None else dict(news.status)

    def moves() -> bool:
        fastest[0] = max(fastest[0], Robot.speed)
        return float(str(status().get("time", 0.0))) > 0.5 and fastest[0] > 0.01

    def steer() -> None:
        try:
            wait(moves)
            before = live.view_state.state
            ask(Pause(do="pause"))
            ask(Grab(do="grab", view="wrist", u=1.0, v=1.0))
            ask(TurnKnob(do="knob", key="gain", value=9.0))
            wait(lambda: len(refused) == 3)
            wait(lambda: not np.array_equal(live.view_state.state, before))  # it goes on
            ask(Stop(do="stop"))
            wait(lambda: status().get("outcome"))
        finally:
            live._stays = False
            if live._loop is not None:
                live._loop.stop()

    steering = threading.Thread(target=steer)
    steering.start()
    try:
        run = live.run()
    finally:
        steering.join()
        live.close()
    assert run.outcome.kind is OutcomeKind.STOPPED
    assert all(text.endswith("allowed: stop: this is a real arm") for text in refused)
    assert Robot.speed < 1e-9 < fastest[0]  # it was braked
    assert Recording.open(tmp_path / "run").outcome.kind is OutcomeKind.STOPPED
