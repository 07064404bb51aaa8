"""On an ideal arm the loop takes the ticks of a period at once, with the same result to the bit."""

import numpy as np
import pytest
from test_batch import drawn_run

from vergence.control import ClearBraking, Guard
from vergence.experiments import CellSource, Sampling, start_trials
from vergence.experiments.batch import KinematicRun
from vergence.experiments.kinematic import KinematicRuns
from vergence.robot import Arm
from vergence.runtime import Run
from vergence.simulation import KinematicDriver
from vergence.studies.guarantees.runs import arms

LAWS = ("own", "image_based", "constrained")
CELLS = ("ur5", "panda", "post", "tag", "so100")


def both_ways(run: KinematicRun, again: KinematicRun, monkeypatch) -> tuple[Run, Run]:
    """Make a run a period at a time, and the same run tick by tick."""
    taken: list[int] = []
    advance = KinematicDriver.advance

    def counted(driver: KinematicDriver, setpoints, ticks: int) -> None:
        taken.append(ticks)
        advance(driver, setpoints, ticks)

    monkeypatch.setattr(KinematicDriver, "advance", counted)
    at_once = run.in_loop()
    assert max(taken) > 1
    monkeypatch.setattr(KinematicDriver, "quiet_ticks", 1)
    taken.clear()
    by_ticks = again.in_loop()
    assert set(taken) <= {1}
    return at_once, by_ticks


def check_same(at_once: Run, by_ticks: Run) -> None:
    assert at_once.outcome == by_ticks.outcome
    first, second = at_once.cameras["camera"], by_ticks.cameras["camera"]
    np.testing.assert_array_equal(first.time, second.time)
    for one, other in (
        (at_once.arms["arm"].position, by_ticks.arms["arm"].position),
        (at_once.arms["arm"].setpoint_rate, by_ticks.arms["arm"].setpoint_rate),
        (first.true_px, second.true_px),
    ):
        np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize("seed", range(0, 120, 4))
def test_any_run_of_optimal_tracking_is_the_same(seed: int, monkeypatch) -> None:
    check_same(*both_ways(drawn_run(seed), drawn_run(seed), monkeypatch))


@pytest.mark.parametrize("name", CELLS)
def test_runs_of_the_shipped_cells_are_the_same_under_any_law(name: str, monkeypatch) -> None:
    cell = CellSource.changed(name, {"duration_s": 3.0}).load()
    bench = KinematicRuns()
    for trial in start_trials(cell, LAWS, 2, 5, Sampling(("starts",), 0.3)):
        changed = cell.replace(**trial.changes)
        with monkeypatch.context() as patched:
            check_same(*both_ways(bench.run_of(changed), bench.run_of(changed), patched))


class Wall:
    """Distances to a wall that joint 0 comes nearer to."""

    def __init__(self, at: float, n: int) -> None:
        self.at, self.margin, self.reach = at, np.array([0.02]), np.eye(n)[:1]
        self.reach_of_others = np.empty((1, 0))

    def distances(self, q: np.ndarray) -> np.ndarray:
        return np.array([self.at - q[0]])

    def others(self) -> np.ndarray:
        return np.empty(0)

    def name(self, pair: int) -> str:
        return "arm and wall"


@pytest.mark.parametrize("seed", range(20))
def test_steps_at_once_stop_short_of_bodies_and_limits_as_single_steps_do(seed: int) -> None:
    rng = np.random.default_rng(seed)
    arm: Arm = arms()[0]
    n, dt = arm.joint_count, 0.002
    q = np.clip(rng.uniform(arm.q_min, arm.q_max), -2.0, 2.0)
    wall = Wall(q[0] + rng.uniform(0.05, 0.6), n)
    many, single = (Guard(arm, q, dt, ClearBraking(arm, wall, dt)) for _ in range(2))
    refused = 0
    for _ in range(60):
        rates = rng.normal(0.3, 1.0, n) * arm.rate_max
        if many.steps(rates, 16) is None:
            refused += 1
            for _ in range(16):
                many.step(rates)
        for _ in range(16):
            single.step(rates)
        assert bool(many.hindrance) == bool(single.hindrance)
        np.testing.assert_array_equal(many.position, single.position)
        np.testing.assert_array_equal(many.setpoint.velocity, single.setpoint.velocity)
    assert single.position[0] < wall.at
    assert refused
