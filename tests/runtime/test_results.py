"""One object for what a run was: the same in memory, from its recording, and in a table."""

from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest

from vergence.assembly import run_cell
from vergence.cell import load_cell
from vergence.errors import InputError
from vergence.geometry import so3_log
from vergence.runtime import Recorder, Recording, Run, RunInfo, RunRecorder, TickRecord
from vergence.runtime.results import Columns, TargetTrace, largest, tick_pose_errors


class TickByTick:
    """Listens to a run and keeps its ticks: what the summary is checked against."""

    def __init__(self) -> None:
        self.records: list[TickRecord] = []

    def begin(self, info: RunInfo) -> None:
        self.info = info

    def tick(self, record: TickRecord) -> None:
        self.records.append(record)

    def event(self, time: float, name: str, text: str) -> None: ...

    def close(self, outcome: object, summary: object) -> None: ...


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("run")


@pytest.fixture(scope="module")
def tracked(folder: Path) -> tuple[Run, TickByTick]:
    """A run whose task desires points."""
    cell, ticks = load_cell("puma560", {"duration_s": "1.0"}), TickByTick()
    recorder = Recorder(folder / "tracked", image_every=0)
    return run_cell(cell, [recorder, ticks], images=False), ticks


@pytest.fixture(scope="module")
def followed(folder: Path) -> tuple[Run, TickByTick]:
    """A run whose task desires a pose, estimated by a filter."""
    cell, ticks = load_cell("eye_to_hand_pose", {"duration_s": "1.0"}), TickByTick()
    recorder = Recorder(folder / "followed", image_every=0)
    return run_cell(cell, [recorder, ticks], images=False), ticks


def test_a_run_shows_itself_in_few_words(tracked, folder: Path) -> None:
    run, _ = tracked
    ending = "completed at 1.00 s: ran for 1 s with the target in view"
    assert repr(run) == f"Run(puma560: {ending}; arms: puma; cameras: wrist)"
    read = Recording.open(folder / "tracked")
    assert repr(read) == f"Recording(puma560: {ending}; arms: puma; cameras: wrist)"
    shown = repr(run.cameras["wrist"])
    assert shown.startswith(f"CameraTrace({len(run.cameras['wrist'].time)} rows of time, received,")
    assert len(shown) < 300


def test_events_are_in_order_of_time(tmp_path: Path) -> None:
    ticks, kept = TickByTick(), RunRecorder()
    run = run_cell(load_cell("puma560", {"duration_s": "0.1"}), [ticks], images=False)
    for listener in (Recorder(tmp_path / "again", image_every=0), kept):
        listener.begin(ticks.info)
        for record in ticks.records:
            listener.tick(record)
        for time, name in ((0.08, "late"), (0.04, "early"), (0.08, "later")):
            listener.event(time, name, "")
        listener.close(run.outcome, run.summary)
    for made in (kept.run(), Recording.open(tmp_path / "again")):
        assert [event.name for event in made.events] == ["early", "late", "later"]


def check_same(one: object, other: object) -> None:
    """Fail where two traces differ."""
    assert type(one) is type(other)
    for column in fields(one):
        first, second = getattr(one, column.name), getattr(other, column.name)
        if isinstance(first, tuple):
            assert first == second, column.name
        else:
            np.testing.assert_array_equal(first, second, err_msg=column.name)


@pytest.mark.parametrize("name", ["tracked", "followed"])
def test_a_run_in_memory_is_the_run_read_from_its_recording(
    name: str, folder: Path, request: pytest.FixtureRequest
) -> None:
    run, _ = request.getfixturevalue(name)
    recording = Recording.open(folder / name)
    assert isinstance(recording, Run)
    for kind in ("arms", "cameras"):
        assert getattr(run, kind).keys() == getattr(recording, kind).keys()
        for key, trace in getattr(run, kind).items():
            check_same(trace, getattr(recording, kind)[key])
    assert (run.target is None) == (name == "tracked")
    check_same(run.target, recording.target) if run.target else None
    assert (run.outcome, run.events) == (recording.outcome, recording.events)
    assert run.summary == recording.summary


def test_the_summary_of_points_is_what_the_ticks_say(tracked: tuple[Run, TickByTick]) -> None:
    run, ticks = tracked
    errors, drifts, measures, penalties = [], [], [], []
    for record in ticks.records:
        if record.observation is None:
            continue
        view, truth = record.observation.views[-1], record.sample.frames[-1].truth
        errors.append(np.linalg.norm(view.points_px - record.reference.points_px, axis=1).max())
        drifts.append(np.linalg.norm(view.points_px - truth.points_px, axis=1).max())
        measures += [command.manipulability for command in record.commands.values()]
        penalties += [command.penalty for command in record.commands.values()]
    assert run.summary["final_error_px"] == pytest.approx(errors[-1])
    assert run.summary["max_error_px"] == pytest.approx(max(errors))
    assert run.summary["max_drift_px"] == pytest.approx(max(drifts))
    assert run.summary["min_manipulability_ratio"] == min(measures) / measures[0]
    assert run.summary["min_penalty"] == min(penalties)
    assert run.summary["duration_s"] == run.outcome.time
    assert run.summary["real_time_factor"] > 0
    assert "final_target_error_m" not in run.summary


def test_the_summary_of_a_pose_is_what_the_ticks_say(followed: tuple[Run, TickByTick]) -> None:
    run, ticks = followed
    target, camera = [], []
    for record in ticks.records:
        state = record.observation.target if record.observation else None
        if state is None:
            continue
        truth = next(f.truth for f in record.sample.frames if f.camera == ticks.info.task_camera)
        target.append(np.linalg.norm((state.T_world_target - truth.T_world_target)[:3, 3]))
        desired = record.reference.T_camera_target
        T = np.linalg.inv(truth.T_world_camera) @ truth.T_world_target
        turn = so3_log(np.ascontiguousarray(T[:3, :3].T @ desired[:3, :3]))
        camera.append((np.linalg.norm((T - desired)[:3, 3]), np.degrees(np.linalg.norm(turn))))
    assert run.summary["final_target_error_m"] == pytest.approx(target[-1])
    assert run.summary["max_target_error_m"] == pytest.approx(max(target))
    assert run.summary["final_pose_error_m"] == pytest.approx(camera[-1][0])
    assert run.summary["max_pose_error_deg"] == pytest.approx(max(deg for _, deg in camera))
    assert "final_error_px" not in run.summary  # no points are desired
    trace = run.cameras[run.info.task_camera]
    assert np.isfinite(trace.error_px).any()  # but where they would be at the pose is known


def test_a_tick_without_an_image_of_the_tasks_camera_has_no_error_of_it(
    followed: tuple[Run, TickByTick],
) -> None:
    ticks = followed[1]
    seen = [r for r in ticks.records if r.observation and r.observation.target and r.sample.frames]
    sample, observation = seen[0].sample, seen[0].observation
    frames = tuple(f for f in sample.frames if f.camera != ticks.info.task_camera)
    views = tuple(v for v in observation.views if v.camera != ticks.info.task_camera)
    record = replace(
        seen[0],
        sample=replace(sample, frames=frames),
        observation=replace(observation, views=views),
    )
    errors = tick_pose_errors(record, ticks.info)
    assert len(errors.time) == 1
    assert np.isfinite(errors.target_rad).all()
    assert np.isnan(errors.camera_rad).all()


def test_setpoints_lead_the_joints(tracked: tuple[Run, TickByTick]) -> None:
    run, _ = tracked
    arm = run.arms["puma"]
    assert len(run.times) == len(arm.position) == len(arm.setpoint) > 20
    assert np.abs(arm.setpoint - arm.position).max() < 0.05
    assert np.abs(np.diff(arm.setpoint, axis=0)).max() > 0


def test_a_table_has_a_row_a_tick_and_one_of_a_camera_a_row_an_image(
    tracked: tuple[Run, TickByTick],
) -> None:
    run, _ = tracked
    table, wrist = run.to_frame(), run.to_frame("wrist")
    np.testing.assert_array_equal(table["time"], run.times)
    np.testing.assert_array_equal(table["puma.position.joint3"], run.arms["puma"].position[:, 2])
    np.testing.assert_array_equal(wrist["time"], run.cameras["wrist"].time)
    np.testing.assert_array_equal(wrist["points_px.0.u"], run.cameras["wrist"].points_px[:, 0, 0])
    received = table["time"].isin(run.cameras["wrist"].received)
    error = run.cameras["wrist"].error_px[:, 0]
    np.testing.assert_array_equal(table["wrist.error_px.0"][received], error)
    with pytest.raises(InputError, match="did you mean wrist"):
        run.to_frame("wirst")


def test_a_table_without_pandas_says_what_to_install(
    tracked: tuple[Run, TickByTick], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(__import__("sys").modules, "pandas", None)
    with pytest.raises(InputError, match="pip install pandas"):
        tracked[0].to_frame()


def test_a_saved_run_has_every_array(tracked: tuple[Run, TickByTick], tmp_path: Path) -> None:
    run, _ = tracked
    run.save(tmp_path / "run.npz")
    with np.load(tmp_path / "run.npz") as saved:
        np.testing.assert_array_equal(saved["puma.position"], run.arms["puma"].position)
        np.testing.assert_array_equal(saved["wrist.found"], run.cameras["wrist"].found)


def test_what_a_run_keeps_cannot_be_written_to(tracked: tuple[Run, TickByTick]) -> None:
    with pytest.raises(ValueError, match="read-only"):
        tracked[0].arms["puma"].position[0, 0] = 1.0


def test_columns_grow_and_a_run_without_an_end_keeps_its_newest_rows() -> None:
    whole, newest = Columns(TargetTrace), Columns(TargetTrace, most=32)
    for k in range(1000):
        for columns in (whole, newest):
            columns.append({"time": float(k), "velocity": np.full(6, k), "unknown": 1})
    np.testing.assert_array_equal(whole.table().time, np.arange(1000.0))
    kept = newest.table()
    assert 16 <= len(kept.time) <= 64
    np.testing.assert_array_equal(kept.time, np.arange(1000.0)[-len(kept.time) :])
    np.testing.assert_array_equal(kept.velocity[:, 3], kept.time)
    assert np.isnan(kept.T_world_target).all()
    assert not kept.consistent.any()


def test_the_largest_distance_leaves_out_what_is_not_known() -> None:
    distances = np.array([[1.0, np.nan, 3.0], [np.nan, np.nan, np.nan]])
    np.testing.assert_array_equal(largest(distances), [3.0, np.nan])
    assert largest(np.empty((2, 0))).shape == (2,)
