"""Campaigns: the same results wherever they are run, nothing lost, laws that begin alike."""

import json
import os
import subprocess
import sys
import time
from pathlib import Path
from threading import Timer

import numpy as np
import pytest

from vergence.cell import load_cell
from vergence.errors import InputError
from vergence.experiments import (
    OWN,
    PRESETS,
    RESULTS,
    CellSource,
    Ending,
    Executor,
    Goal,
    Sampling,
    Trial,
    TrialResult,
    WorkersLostError,
    heading_trials,
    law_table,
    place_trials,
    run_campaign,
    run_trial,
    run_trials,
    scores,
    start_trials,
)
from vergence.experiments.batch import KinematicRun, run_batch
from vergence.experiments.kinematic import KinematicRuns, is_ideal
from vergence.parts import kind_of
from vergence.runtime import Run, RunInfo
from vergence.signals import Outcome, OutcomeKind

QUICK = {"duration_s": "1.0", "task.feature_count": "4", "target.motion": "{ kind = 'stationary' }"}
ALONE = Executor(workers=1)
RUN_TRIAL = "vergence.experiments.run_trial"


@pytest.fixture(scope="module")
def source():
    return CellSource.of("puma560", QUICK, None)


@pytest.fixture(scope="module")
def trials(source):
    return start_trials(
        source.load(), ["image_based", "constrained"], 6, seed=3, sampling=Sampling(spread=0.1)
    )


@pytest.fixture(scope="module")
def results(source, trials, tmp_path_factory):
    """What the trials come to in this process."""
    return run_campaign(source, trials, tmp_path_factory.mktemp("alone"), executor=ALONE)


def test_every_trial_has_a_result_in_the_order_of_the_trials(trials, results):
    assert [result.key for result in results] == [trial.key for trial in trials]
    assert {result.ending for result in results} <= {Ending.CONVERGED, Ending.OFF_GOAL}
    assert all(result.final_error_px is not None for result in results)


def test_a_result_is_a_function_of_cell_and_trial(source, trials, results):
    assert run_trial(source, trials[0], 2.0) == results[0]
    assert TrialResult.from_json(json.loads(json.dumps(results[0].as_json()))) == results[0]


@pytest.fixture(scope="module")
def tracking():
    """The cell with its one feature, whose law the batch kernel knows."""
    return CellSource.of("puma560", {"duration_s": "1.0"}, None)


@pytest.fixture(scope="module")
def quick_trials(tracking):
    """Trials of that law."""
    cell = tracking.load()
    near, far = place_trials(cell, 0.3, 3, 0.2), heading_trials(cell, 3.0, 3, (1.0, 3.0))
    return [*near, *far, *start_trials(cell, [OWN], 5, seed=3, sampling=Sampling(spread=0.3))]


@pytest.fixture(scope="module")
def quick_results(tracking, quick_trials):
    return run_trials(tracking, quick_trials, 2.0)


def test_a_batch_of_trials_comes_to_what_each_of_them_comes_to_in_the_loop(
    tracking, quick_trials, quick_results, monkeypatch
):
    in_batch = quick_results
    made_in = [result.made_in for result in in_batch]
    assert made_in.count("kernel") > 0.8 * len(in_batch), made_in
    monkeypatch.setattr(sys.modules[RUN_TRIAL], "covers", lambda _: False)
    check_same(in_batch, run_trials(tracking, quick_trials, 2.0))
    assert {result.ending for result in in_batch} >= {Ending.CONVERGED, Ending.OUT_OF_VIEW}


def check_same(results, looped):
    for one, other in zip(results, looped, strict=True):
        assert (one.key, one.ending, one.reason) == (other.key, other.ending, other.reason)
        assert other.made_in == "loop"
        for name, value in one.as_json().items():
            if isinstance(value, float | tuple):
                assert value == pytest.approx(getattr(other, name), rel=1e-9, abs=1e-9), name


MALIS = """{ objectives = [
    { kind = 'image_based', feature = 'centre', gain = 2.0 },
    { kind = 'image_based', feature = 'log_depth', gain = 2.0 },
    { kind = 'point_pose', axes = ['rx', 'ry', 'rz'], gain = 2.0 },
], solver = 'damped_pseudo_inverse' }"""


@pytest.mark.parametrize(
    ("name", "laws"),
    [
        ("ur5", ("image_based", "constrained", "optimal_tracking")),
        ("ur5", ("point_pose", "constrained_point_pose", "malis")),
        ("puma560", ("image_based", "constrained")),
    ],
)
def test_laws_of_shipped_cells_come_in_the_kernel_to_what_they_come_to_in_the_loop(
    name, laws, monkeypatch
):
    source = CellSource.of(name, {"duration_s": "2.0", "laws.malis": MALIS}, None)
    trials = start_trials(source.load(), laws, 3, seed=3, sampling=Sampling(spread=0.2))
    for trial in {trial.labels["law"]: trial for trial in trials}.values():  # compiled, if need be
        run_batch([KinematicRuns().run_of(source.load().replace(**trial.changes))])
    results = run_trials(source, trials, 2.0)
    made_in = [(trial.labels["law"], r.made_in) for trial, r in zip(trials, results, strict=True)]
    assert {(law, "kernel") for law in laws} <= set(made_in)
    monkeypatch.setattr(sys.modules[RUN_TRIAL], "covers", lambda _: False)
    check_same(results, run_trials(source, trials, 2.0))


def test_a_run_of_a_campaign_aims_at_the_depth_that_its_goal_implies():
    still = {"duration_s": "3.0", "target.motion": "{ kind = 'stationary' }"}
    source, laws = CellSource.of("ur5", still, None), ("point_pose", "image_based_desired")
    trials = start_trials(source.load(), laws, 1, seed=3, sampling=Sampling(spread=0.2))
    for ideal, trial in zip(run_trials(source, trials, 2.0), trials, strict=True):
        real = run_trial(source, trial, 2.0, physics=True)
        assert ideal.ending is real.ending is Ending.CONVERGED
        assert ideal.path_m == pytest.approx(real.path_m, rel=0.03)


def test_a_law_that_the_kernel_is_not_compiled_for_is_run_in_the_loop(monkeypatch):
    source = CellSource.of("ur5", {"duration_s": "0.2"}, None)
    trials = start_trials(source.load(), ("image_based",), 1, seed=3)
    monkeypatch.setattr(sys.modules[RUN_TRIAL], "is_ready", lambda _: False)
    assert [result.made_in for result in run_trials(source, trials, 2.0)] == ["loop"]


def test_physics_ends_the_runs_alike(tracking, quick_trials, quick_results):
    for ideal, trial in zip(quick_results[:9], quick_trials, strict=False):
        real = run_trial(tracking, trial, 2.0, physics=True)
        assert real.ending is ideal.ending
        assert real.max_error_px == pytest.approx(ideal.max_error_px, abs=1.0)


def test_a_feature_that_the_arm_itself_hides_is_not_seen_by_the_batch_either():
    source = CellSource.of("puma560", {}, None)
    places = place_trials(source.load(), 0.5, 11, 0.1)
    hidden = next(trial for trial in places if trial.key == "own/place/4/10")
    found = run_trial(source, hidden, 2.0)
    assert found.ending is Ending.LOST
    assert found.time_s == pytest.approx(run_trial(source, hidden, 2.0, physics=True).time_s)


def test_the_guard_ends_runs_of_a_campaign_before_a_collision():
    source = CellSource.of("post", {"duration_s": "9.0"}, None)
    limits = {"limits": {"order": ["view", "singularity", "joint margin"]}}
    law = {"kind": "image_based", "solver": {"kind": "quadratic_program", "S": 1e-5}, **limits}
    found = run_trial(source, Trial("unlimited", {"law": {"gain": 4.0, **law}}), 2.0)
    assert found.ending is Ending.COLLISION
    assert "scene/post" in found.reason
    assert found.time_s < 8.5


def test_a_planned_way_is_tried_as_run_does_it():
    desired = [[280.0, 200.0], [360.0, 200.0], [360.0, 280.0], [280.0, 280.0]]
    cell = load_cell("ur5").replace(task={"desired": desired})
    assert is_ideal(cell)
    assert not is_ideal(cell.replace(task={"approach": "auto"}))


def test_laws_set_out_from_the_same_starts_which_see_the_target(source, trials):
    half = len(trials) // 2
    for plain, constrained in zip(trials[:half], trials[half:], strict=True):
        assert plain.changes["arms"] == constrained.changes["arms"]
        assert plain.changes["law"] != constrained.changes["law"]
    cell = source.load()
    fewer = Sampling(spread=0.1).changes(cell, Goal.of(cell), 2, seed=3)
    assert fewer[1]["arms"] == trials[1].changes["arms"]


def test_a_campaign_continues_where_it_was_cut_off(source, trials, results, tmp_path):
    whole = tmp_path / "whole"
    run_campaign(source, trials, whole, executor=ALONE)
    lines = (whole / RESULTS).read_text().splitlines(keepends=True)
    part = tmp_path / "part"
    part.mkdir()
    (part / RESULTS).write_text("".join(lines[:4]) + lines[4][:40])  # header, three, and a half
    seen = []
    again = run_campaign(
        source, trials, part, executor=ALONE, progress=lambda done, total: seen.append(done)
    )
    assert seen == list(range(3, len(trials) + 1))
    assert again == results
    assert len((part / RESULTS).read_text().splitlines()) == len(trials) + 1


def test_results_of_another_campaign_are_not_resumed(source, trials, tmp_path):
    run_campaign(source, trials[:1], tmp_path, executor=ALONE)
    with pytest.raises(InputError, match="trials differ"):
        run_campaign(source, trials[:2], tmp_path, executor=ALONE)
    with pytest.raises(InputError, match="tolerance_px differ"):
        run_campaign(source, trials[:1], tmp_path, executor=ALONE, tolerance_px=1.0)


def test_a_trial_that_cannot_be_begun_is_a_result_with_its_reason(source):
    away = Trial("away", {"target": {"position_m": [5.0, 5.0, 0.0], "features": [[0, 0, 0]]}})
    result = run_trial(source, away, 2.0)
    assert result.ending is Ending.REFUSED
    assert "does not see" in result.reason


def test_a_run_that_the_user_stops_is_no_result(source, trials, monkeypatch):
    outcome = Outcome(OutcomeKind.STOPPED, "stopped by the user", 0.5)
    stopped = Run(RunInfo("puma560"), {}, {}, None, (), outcome, {}, {})
    module = sys.modules[RUN_TRIAL]
    monkeypatch.setattr(module, "run_cell", lambda *_, **__: stopped)
    monkeypatch.setattr(module, "covers", lambda _: False)
    monkeypatch.setattr(KinematicRun, "in_loop", lambda *_: stopped)
    for physics in (True, False):
        with pytest.raises(KeyboardInterrupt):
            run_trial(source, trials[0], 2.0, physics=physics)


def test_endings_are_told_apart(source):
    cell = source.load()
    far = heading_trials(cell, 3.0, 1, (3.0,), law="image_based")[0]
    assert run_trial(source, far, 2.0).ending is Ending.OUT_OF_VIEW
    blind = Trial("blind", {**far.changes, "cameras": {"wrist": {"blind_s": [[0.1, 9.0]]}}})
    still = {**blind.changes, "target": {**far.changes["target"], "motion": {"kind": "stationary"}}}
    assert run_trial(source, Trial("lost", still), 2.0).ending is Ending.LOST


def test_maps_cover_the_square_and_all_directions(source):
    cell = source.load()
    places = place_trials(cell, 0.2, 3, 0.1)
    assert len({trial.key for trial in places}) == 9
    assert [t.labels["x_m"] for t in places[:3]] == [-0.2, 0.0, 0.2]
    assert places[4].changes["target"]["motion"]["kind"] == "stationary"
    headings = heading_trials(cell, 0.5, 4, (0.1, 0.2))
    assert len({trial.key for trial in headings}) == 8
    quarter = headings[5].changes["target"]["motion"]["velocity_m_s"]
    assert quarter == pytest.approx([0.0, 0.2, 0.0])


def test_the_target_goes_as_far_as_the_map_says(source):
    trial = place_trials(source.load(), 0.05, 2, 0.1, law="constrained")[0]
    result = run_trial(source, trial, 20.0)
    assert result.target_m == pytest.approx(0.05 * np.sqrt(2), abs=1e-6)
    assert result.ending is Ending.CONVERGED


def test_scores_count_every_trial_once(results):
    found = scores(results)
    assert [score.law for score in found] == ["image_based", "constrained"]
    assert sum(score.trials for score in found) == len(results)
    assert found[1].count(Ending.CONVERGED) == sum(
        r.ending is Ending.CONVERGED for r in results if r.labels["law"] == "constrained"
    )


def test_laws_are_found_by_name(tmp_path):
    cell = load_cell("ur5", {"laws.mine": "{ kind = 'image_based', gain = 7.0 }"})
    assert law_table(cell, "mine")["gain"] == 7.0
    assert law_table(cell, OWN)["gain"] == cell.law.objective.gain
    for name in PRESETS:
        law = cell.replace(law=law_table(cell, name)).law
        assert law.kind == PRESETS[name]["kind"]
        assert kind_of(law.solver) == PRESETS[name]["solver"]
    assert law_table(cell, "image_based")["gain"] == cell.law.objective.gain
    with pytest.raises(InputError, match="did you mean image_based"):
        law_table(cell, "image_basde")


@pytest.mark.parametrize(("name", "seconds"), [("lippiello2005", "0.5"), ("eye_to_hand_pose", "4")])
def test_a_campaign_holds_the_pose_a_cell_follows_fast(name, seconds):
    changed = {"duration_s": seconds, "target.motion": "{ kind = 'stationary' }"}
    cell, source = load_cell(name, changed), CellSource.of(name, changed, None)
    goal = Goal.of(cell)
    again = Goal.of(cell.replace(**goal.tables))
    np.testing.assert_allclose(again.desired_px, goal.desired_px, atol=1e-3)
    (result,) = run_trials(source, [Trial("own", goal.tables)], 5.0)
    assert result.ending is Ending.CONVERGED, result


def test_a_reach_is_tried_from_random_starts_before_random_targets():
    cell = load_cell("gantry")
    drawn = start_trials(cell, [OWN], 2, 0, Sampling(("starts", "targets"), 0.05))
    results = run_trials(CellSource.of("gantry", {}, None), drawn, 2.0)
    assert {result.ending for result in results} == {Ending.CONVERGED}
    assert len({result.start_m for result in results}) == 2
    (short,) = run_trials(CellSource.of("gantry", {}, None), [Trial("short", {"duration_s": 1})], 2)
    assert short.ending is Ending.OTHER
    assert "the path takes" in short.reason
    with pytest.raises(InputError, match="headings"):
        heading_trials(cell, 1.0, 4, (0.1,))


def test_targets_and_motions_are_drawn_by_seed_and_refused_where_they_cannot_be():
    cell = load_cell("puma560")
    sampling = Sampling(("targets", "motions"), 0.1, 0.2)
    goal = Goal.of(cell)
    first, second = sampling.changes(cell, goal, 2, seed=1)
    assert sampling.changes(cell, goal, 1, seed=1) == [first]
    assert first["target"]["position_m"] != second["target"]["position_m"]
    speeds = np.linalg.norm(
        [d["target"]["motion"]["velocity_m_s"] for d in (first, second)], axis=1
    )
    assert (speeds <= 0.2).all()
    assert "arms" not in first
    held = load_cell("eye_to_hand_pose")
    with pytest.raises(InputError, match="is held by"):
        sampling.changes(held, Goal.of(held), 1, seed=1)
    with pytest.raises(InputError, match="did you mean targets"):
        Sampling(("target",))


def test_an_address_without_a_scheduler_is_refused(source, trials, tmp_path):
    with pytest.raises(InputError, match="address of a Dask scheduler"):
        run_campaign(source, trials, tmp_path, executor=Executor(scheduler="nonsense://here"))


class Cluster:
    """A Dask scheduler and two workers, each a process of its own.

    Args:
        folder: for its files.
        deaths: of workers over the same task until that is given up.
    """

    def __init__(self, folder: Path, deaths: int = 3) -> None:
        self.environment = os.environ | {
            "DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES": str(deaths - 1)
        }
        self.file = folder / "scheduler.json"
        where = ["--scheduler-file", str(self.file), "--no-dashboard"]
        self.processes = [self._start("scheduler", [*where, "--port", "0", "--host", "127.0.0.1"])]
        while not self.file.exists():
            time.sleep(0.05)
        alone = ["--no-nanny", "--nthreads", "1", "--local-directory", str(folder)]
        self.workers = [self._start("worker", [*where, *alone]) for _ in range(2)]
        self.processes += self.workers
        self.address = json.loads(self.file.read_text())["address"]

    def _start(self, part: str, options: list[str]) -> "subprocess.Popen[bytes]":
        command = [sys.executable, "-m", f"distributed.cli.dask_{part}", *options]
        quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
        return subprocess.Popen(command, env=self.environment, **quiet)

    def close(self) -> None:
        for process in reversed(self.processes):
            process.kill()
            process.wait()


def test_a_worker_killed_midway_loses_nothing_and_changes_nothing(
    source, trials, results, tmp_path
):
    cluster = Cluster(tmp_path)
    try:
        cluster_wait(cluster)

        def kill_one(done: int, total: int) -> None:
            if done == 3:
                cluster.workers[0].kill()

        found = run_campaign(
            source,
            trials,
            tmp_path / "run",
            executor=Executor(scheduler=cluster.address),
            progress=kill_one,
        )
    finally:
        cluster.close()
    assert cluster.workers[0].returncode != 0
    assert found == results


def cluster_wait(cluster: Cluster) -> None:
    """Wait until both workers are there, so that both have a share of the work."""
    from distributed import Client

    with Client(cluster.address) as client:
        client.wait_for_workers(2)


def test_processes_of_this_machine_find_the_same(source, trials, results, tmp_path):
    assert run_campaign(source, trials[:4], tmp_path, executor=Executor(workers=2)) == results[:4]


def test_a_cluster_runs_batches_too(tracking, quick_trials, quick_results, tmp_path):
    cluster = Cluster(tmp_path)
    try:
        cluster_wait(cluster)
        executor = Executor(scheduler=cluster.address)
        found = run_campaign(tracking, quick_trials, tmp_path / "run", executor=executor)
    finally:
        cluster.close()
    assert list(found) == quick_results


@pytest.mark.parametrize(
    ("whom", "said"),
    [
        (slice(1, 3), "every worker that took it was killed, 1 in all"),
        (slice(0, 1), "the scheduler has disappeared"),
    ],
    ids=["workers", "scheduler"],
)
def test_a_run_that_nobody_survives_ends_in_a_clear_message(source, trials, tmp_path, whom, said):
    endless = Trial("endless", {**trials[0].changes, "duration_s": 3600.0})
    cluster = Cluster(tmp_path, deaths=1)
    try:
        cluster_wait(cluster)
        killing = Timer(1.0, lambda: [process.kill() for process in cluster.processes[whom]])
        killing.start()
        with pytest.raises(WorkersLostError, match=f"run endless: {said}"):
            list(Executor(scheduler=cluster.address).run(source, [endless], 2.0))
        killing.join()
    finally:
        cluster.close()


def test_without_dask_only_a_scheduler_is_refused(source, trials, results, monkeypatch):
    from vergence import optional_package

    def missing(module):
        raise ImportError(f"No module named {module!r}", name=module)

    monkeypatch.setattr(optional_package, "import_module", missing)
    shared = list(Executor(workers=2).run(source, trials[:2], 2.0))
    assert {result.key for result in shared} == {result.key for result in results[:2]}
    with pytest.raises(InputError, match=r"pip install 'vergence\[cluster\]'"):
        list(Executor(scheduler="tcp://127.0.0.1:1").run(source, trials[:2], 2.0))
