"""Tasks one after another: one driver, one recording, and every limit kept in between."""

from dataclasses import replace

import numpy as np
import pytest

from vergence.app.report import make_report
from vergence.assembly import run_cell, run_driver
from vergence.cell import load_cell
from vergence.errors import InputError
from vergence.runtime import DriverWrapper, Recorder, Recording
from vergence.signals import OutcomeKind
from vergence.simulation import SimulatedDriver


@pytest.fixture
def panda(tmp_path):
    """Return a function that makes a cell of several tasks over a board at rest."""
    source = load_cell("panda").path
    text = source.read_text().replace("../puma560", str(source.parents[1] / "puma560"))
    head = text[: text.index("[task]")]
    law = text[text.index("[law]") :]

    def cell(*tasks, changes=None):
        path = tmp_path / "cell.toml"
        shared = 'arm = "panda"\ncamera = "hand"\n'
        path.write_text(head + "".join(f"[[tasks]]\n{shared}{task}\n" for task in tasks) + law)
        return load_cell(path, {"target.motion": "stationary", **(changes or {})})

    return cell


class Watched(SimulatedDriver):
    """Keeps every set-point of the Panda that it is handed."""

    def __init__(self, cell, images=True):
        super().__init__(cell, images)
        self.setpoints = []

    def step(self, setpoints):
        self.setpoints.append(setpoints["panda"])
        super().step(setpoints)


LOOK = 'name = "look"\nuntil = { kind = "time", time_s = 0.4 }'
# Cut off in full motion.
SHIFT = """name = "shift"
desired = [[342.5, 143.5], [351.6, 291.4], [483.4, 99.6], [483.4, 307.5]]
until = { kind = "time", time_s = 0.3 }"""
CENTRE = 'desired = "centred"\nuntil = { kind = "reached", time_s = 0.2 }'


def test_tasks_are_done_one_after_another_within_all_limits(panda):
    cell = panda(SHIFT, CENTRE, LOOK)
    driver = Watched(cell, images=False)
    run = run_driver(cell, driver, (), images=False)
    assert run.outcome.kind is OutcomeKind.COMPLETED
    first, second, third = run.outcome.tasks
    assert [first.name, second.name, third.name] == ["shift", "track", "look"]
    assert second.outcome.kind is OutcomeKind.REACHED
    assert first.outcome.time < second.begun < second.outcome.time < third.begun
    assert third.outcome.time == run.outcome.time == pytest.approx(third.begun + 0.4, abs=0.05)
    arm, dt = driver.arms["panda"], 1.0 / cell.inner_rate_hz
    q = np.array([setpoint.position for setpoint in driver.setpoints])
    rates = np.array([setpoint.velocity for setpoint in driver.setpoints])
    assert (q >= arm.q_min).all()
    assert (q <= arm.q_max).all()
    assert (np.abs(rates) <= arm.rate_max * (1 + 1e-9)).all()
    changes = np.abs(np.diff(np.vstack((0 * rates[:1], rates)), axis=0)) / dt
    assert (changes <= arm.acceleration_max * (1 + 1e-9)).all()
    np.testing.assert_allclose(np.diff(q, axis=0), rates[1:] * dt, atol=1e-9)
    assert np.abs(rates).max() > 0.1  # it has moved at all


def test_a_recording_has_one_time_and_how_each_task_ended(panda, tmp_path):
    cell = panda(LOOK, 'name = "three points"\npoints_px = [[300.0, 220.0], [340.0, 200.0], '
                 '[320.0, 260.0]]\nuntil = { kind = "time", time_s = 0.3 }',
                 changes={"target.features": ""})  # fmt: skip
    run = run_cell(cell, [Recorder(tmp_path / "run")])
    read = Recording.open(tmp_path / "run")
    assert read.outcome == run.outcome
    assert [task.name for task in read.outcome.tasks] == ["look", "three points"]
    time = read.arms["panda"].time
    assert (np.diff(time) > 0.02).all()
    assert (np.diff(time) < 0.05).all()
    counts = read.cameras["hand"].found.sum(axis=1)
    assert set(counts) == {0, 1, 3}  # features of the first task, none in between, of the second
    page = make_report(read)
    assert "three points" in page


class Bare(DriverWrapper):
    """A driver that is not known to be simulated, so that its clock cannot be stopped."""

    def read(self):
        sample = self.driver.read()
        return replace(sample, frames=tuple(replace(f, truth=None) for f in sample.frames))


def test_a_robot_is_held_by_the_loop_while_its_next_task_is_put_together(panda):
    cell = panda(LOOK, CENTRE, changes={"duration_s": "60.0"})
    driver = Watched(cell, images=True)
    run = run_driver(cell, Bare(driver), (), images=True)
    driver.close()
    assert [task.outcome.kind.value for task in run.outcome.tasks] == ["completed", "reached"]
    time = run.arms["panda"].time
    assert np.diff(time).max() < 0.05
    assert len(driver.setpoints) >= int(run.outcome.time * cell.inner_rate_hz)


def test_a_task_that_cannot_begin_where_the_arm_is_ends_the_run_and_says_which(panda):
    away = "points_px = [[10.0, 10.0]]\ndesired = [[900.0, 10.0]]"
    run = run_cell(panda(LOOK, away), images=False)
    assert run.outcome.kind is OutcomeKind.INFEASIBLE
    assert run.outcome.reason.startswith("task 2 of 2, track: ")
    assert "tasks.1." in run.outcome.reason
    assert [task.outcome.kind.value for task in run.outcome.tasks] == ["completed", "infeasible"]


def test_a_task_whose_time_is_over_is_not_reached(panda):
    never = 'until = { kind = "joint", joint = "panda_joint1", above_deg = 100 }'
    run = run_cell(panda(LOOK, never, changes={"duration_s": "1.0"}), images=False)
    assert run.outcome.kind is OutcomeKind.NOT_REACHED
    assert run.outcome.reason.startswith("task 2 of 2, track: ")


@pytest.mark.parametrize(
    ("tasks", "key", "words"),
    [
        (("until = 'reachd'", ""), "tasks.0.until.kind", "did you mean reached"),
        (("until = { kind = 'time' }", ""), "tasks.0.until.time_s", "missing; needed: a value"),
        (("", LOOK), "tasks.0.until", "tasks.1 never begins"),
        ((LOOK, "law = 'fast'"), "tasks.1.law", "one of [laws]"),
        ((LOOK, "feature_count = 0"), "tasks.1.feature_count", "at least 1"),
        (("kind = 'trak'", LOOK), "tasks.0.kind", "did you mean track"),
        (("until = { kind = 'joint', joint = 'elbow', above_deg = 0 }", ""), "tasks.0.until.joint",
         "panda_joint1"),
        (("until = { kind = 'joint', joint = 'panda_joint1' }", ""), "tasks.0.until",
         "either above_deg or below_deg"),
        ((LOOK, "kind = 'follow'"), "law.kind", "for the task follow: position_based"),
        ((LOOK, "kind = 'reach'\ngoal = 'goal.png'"), "tasks.1.goal", "--no-images"),
    ],
)  # fmt: skip
def test_tasks_that_cannot_follow_each_other_are_refused_by_key(panda, tasks, key, words):
    with pytest.raises(InputError) as caught:
        run_cell(panda(*tasks), images=False)
    assert caught.value.key == key
    assert words in str(caught.value)


def test_one_task_or_several_but_not_both_nor_none(panda):
    for changes, words in (
        ({"task.camera": '"hand"'}, "task cannot be combined with tasks"),
        ({"tasks": "[]"}, "at least one task"),
        ({"tasks": "3"}, "a list of tables"),
        ({"tasks.2.camera": '"hand"'}, "given number 2; allowed: 0 to 1"),
        ({"tasks.1.camera": '"eye"'}, "hand, as in the first task"),
    ):
        with pytest.raises(InputError, match="tasks") as caught:
            panda(LOOK, "", changes=changes)
        assert words in str(caught.value)


OWN = """
from vergence.parts import part
from vergence.signals import Outcome, OutcomeKind

@part("task_end")
class Enough:
    images: int = 3

    def bind(self, setting):
        self.__dict__["left"] = self.images
        return self

    def over(self, moment):
        self.__dict__["left"] -= 1
        return None if self.left else Outcome(OutcomeKind.REACHED, "enough", moment.time)
"""


def test_an_end_of_ones_own_is_a_class_beside_the_cell(panda, tmp_path):
    (tmp_path / "mine.py").write_text(OWN)
    run = run_cell(panda("until = 'mine:Enough'", LOOK), images=False)
    first, second = run.outcome.tasks
    assert first.outcome.reason == "enough"
    assert first.outcome.time == pytest.approx(3 / 30, abs=0.04)
    assert second.outcome.succeeded


def test_tasks_that_are_set_take_the_place_of_the_one_in_the_file():
    tasks = '[{arm = "panda", camera = "hand", until = {kind = "time", time_s = 0.1}}]'
    changed = load_cell("panda", {"tasks": tasks})
    assert changed.task.until.time_s == 0.1
    replaced = load_cell("panda").replace(tasks=[changed.task])
    assert replaced.tasks == changed.tasks


def test_a_value_of_one_of_the_tasks_can_be_set(panda):
    cell = panda(LOOK, "", changes={"tasks.0.until.time_s": "0.1", "tasks.1.tolerance_px": "3"})
    assert cell.task.until.time_s == 0.1
    assert cell.tasks[1].tolerance_px == 3
    assert cell.replace(seed=5).tasks == cell.tasks


def test_points_that_are_picked_after_a_task_without_any_are_those_of_the_next_task():
    track = {"kind": "track", "arm": "puma", "camera": "wrist"}
    tasks = [
        {**track, "until": {"kind": "time", "time_s": 0.1}},
        {"kind": "advance", "arm": "puma", "camera": "wrist", "distance_m": 0.002},
        {**track, "until": {"kind": "time", "time_s": 0.1}},
    ]
    law = {"kind": "image_based"}
    still = {"motion": "stationary"}
    cell = load_cell("puma560").replace(tasks=tasks, law=law, target=still)
    run = run_cell(cell, images=False)
    assert [task.outcome.kind.value for task in run.outcome.tasks] == [
        "completed", "reached", "completed"
    ]  # fmt: skip
