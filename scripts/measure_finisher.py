#!/usr/bin/env python
"""Measure what luminance adds at the end of the way to a photograph.

Random photographs of `vergence reproduce photograph`, each neared from a start of 4 degrees in the
joints away: how far the camera is from its goal when the points have arrived, and at the end.

    scripts/measure_finisher.py [TRIALS]
"""

import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

import numpy as np

from vergence.assembly import run_driver, with_goal
from vergence.cell import load_cell
from vergence.signals import OutcomeKind
from vergence.simulation import SimulatedDriver
from vergence.studies.photograph.trials import (
    ARM,
    CAMERA,
    SCENES,
    Trial,
    apart,
    take_photograph,
)

SEED, AWAY_DEG, TURNED_DEG = 7, 4.0, 15.0
CASES = {
    "the same light": (1.0, 1.0),  # light over that of the photograph, noise in grey values
    "the same light, noise of 4 grey values": (1.0, 4.0),
    "0.6 to 1.3 times the light": (None, 1.0),
}


class Ends(NamedTuple):
    """Distance, m, and angle, degrees, from the goal."""

    points: tuple[float, float]  # when luminance took over
    luminance: tuple[float, float]  # at the end
    handed_back: bool


def ends(number: int, light: float | None, noise_grey: float) -> Ends | None:
    """Return how a trial ends; None if the photograph is not reached."""
    trial = Trial.drawn(SEED, number)
    away = trial.start_deg - trial.goal_deg
    away *= AWAY_DEG / np.abs(away[:5]).max()
    away[5] = np.clip(away[5], -TURNED_DEG, TURNED_DEG)
    cell = load_cell("photograph", seed=number).replace(
        arms={ARM: {"start_deg": (trial.goal_deg + away).tolist()}},
        scene={"light": trial.light if light is None else light},
        cameras={CAMERA: {"noise_grey": noise_grey}},
        target={"model": SCENES[trial.scene]},
    )
    with TemporaryDirectory() as folder:
        path = Path(folder) / "goal.png"
        take_photograph(cell, trial, path)
        driver = SimulatedDriver(with_goal(cell, path).replace(task={"finish": "luminance"}))
        try:
            goal = driver.frame_at(CAMERA, ARM, np.deg2rad(trial.goal_deg)).truth
            assert goal is not None
            run = run_driver(driver.cell, driver, (), images=True)
        finally:
            driver.close()
    if run.outcome.kind is not OutcomeKind.REACHED:
        return None
    events = {event.name: event.time for event in run.events}
    seen = run.cameras[CAMERA]
    by_points = seen.T_world_camera[np.searchsorted(seen.time, events["luminance takes over"])]
    return Ends(
        apart(by_points, goal.T_world_camera),
        apart(seen.T_world_camera[-1], goal.T_world_camera),
        "luminance hands back" in events,
    )


def main(count: int) -> None:
    """Print three lines a case."""
    for case, (light, noise_grey) in CASES.items():
        found = [ends(number, light, noise_grey) for number in range(count)]
        reached = [each for each in found if each is not None]
        print(f"{case}: {len(reached)} of {count} reached")
        for name in ("points", "luminance"):
            m, deg = np.array([getattr(each, name) for each in reached]).T
            print(
                f"  {name:10s} median {1e3 * np.median(m):.4f} mm, {np.median(deg):.5f} deg; "
                f"largest {1e3 * m.max():.3f} mm, {deg.max():.4f} deg"
            )
        worse = sum(each.luminance[0] > each.points[0] for each in reached)
        back = sum(each.handed_back for each in reached)
        print(f"  farther than by the points: {worse}; handed back: {back}", flush=True)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 24)
