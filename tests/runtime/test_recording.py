"""What is recorded reads back the same, whole or cut off."""

import json
from pathlib import Path

import numpy as np
import pytest

from vergence.camera import Camera
from vergence.errors import InputError
from vergence.runtime import ArmInfo, RunInfo, TickRecord
from vergence.runtime.recording import Recorder, Recording
from vergence.signals import (
    Frame,
    FrameTruth,
    ImagePoints,
    JointCommand,
    JointState,
    Observation,
    Outcome,
    OutcomeKind,
    Reference,
    Sample,
    SearchWindows,
    TargetState,
)

DONE = Outcome(OutcomeKind.COMPLETED, "it followed to the end", 1.25)
DESIRED_PX = np.array([[10.0, 20.0], [50.0, 30.0]])
INFO = RunInfo(
    cell="bench",
    text='name = "bench"  # wörtlich\n',
    seed=7,
    arms={"left": ArmInfo(("slide", "turn"), [-1.0, -np.inf], [1.0, np.inf], [0.5, 2.0])},
    cameras={"wrist": Camera(64, 48, 80.0, 81.0, 31.5, 23.5), "wall": Camera(64, 48, 60, 60, 1, 2)},
)
LOST = "point 1 of wrist left the image; " * 10 + "it is looked for"


def record_at(time: float, rng: np.random.Generator) -> TickRecord:
    pose = np.eye(4)
    pose[:3, 3] = rng.normal(size=3)
    truth = FrameTruth(
        pose, np.eye(4), rng.uniform(0, 48, (2, 2)), np.ones(2), np.ones(2, dtype=bool)
    )
    frame = Frame("wrist", time - 0.1, rng.integers(0, 255, (48, 64), dtype=np.uint8), {}, truth)
    view = ImagePoints(
        "wrist",
        frame.time,
        rng.uniform(0, 48, (2, 2)),
        rng.normal(size=(2, 2, 2)),
        np.array([True, False]),
        ("", "left the image"),
        SearchWindows(np.array([[1.0, 2.0], [np.nan] * 2]), np.array([[8.0, 9.0], [np.nan] * 2])),
    )
    target = TargetState(time, pose, rng.normal(size=6), rng.normal(size=(12, 12)), True)
    command = JointCommand(
        rng.normal(size=2),
        rng.normal(size=6),
        0.4,
        0.9,
        ("rate of turn",),
        slack={"view": 0.5},
        errors={"size": 0.25, "centre.0": -1.0},
    )
    return TickRecord(
        time,
        Sample(time, {"left": JointState(time, *rng.normal(size=(2, 2)))}, (frame,)),
        Observation(frame.time, (view,), target),
        Reference(time, points_px=DESIRED_PX),
        {"left": command},
    )


@pytest.fixture
def records(rng: np.random.Generator) -> list[TickRecord]:
    return [record_at(time, rng) for time in np.arange(0.1, 4.1, 0.1).tolist()]


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(5)


def recorder_with(folder: Path, records: list[TickRecord]) -> Recorder:
    recorder = Recorder(folder)
    recorder.begin(INFO)
    for record in records:
        recorder.tick(record)
    return recorder


def whole(folder: Path, records: list[TickRecord]) -> Recording:
    recorder = recorder_with(folder, records)
    recorder.event(2.5, "feature lost", LOST)
    recorder.close(DONE, {"max error": 3.5, "note": "fine", "drift": float("nan")})
    return Recording.open(folder)


def test_numbers_of_an_arm_read_back_exactly(tmp_path: Path, records: list[TickRecord]) -> None:
    arm = whole(tmp_path, records).arms["left"]
    states = [record.sample.joints["left"] for record in records]
    commands = [record.commands["left"] for record in records]
    np.testing.assert_array_equal(arm.time, [record.time for record in records])
    np.testing.assert_array_equal(arm.position, [state.position for state in states])
    np.testing.assert_array_equal(arm.velocity, [state.velocity for state in states])
    np.testing.assert_array_equal(arm.command, [command.velocity for command in commands])
    np.testing.assert_array_equal(arm.v_camera, [command.v_camera for command in commands])
    assert arm.errors == tuple(command.errors for command in commands)
    assert set(arm.manipulability) == {0.4}
    assert set(arm.penalty) == {0.9}
    assert set(arm.active) == {("rate of turn",)}
    assert all(bent == {"view": 0.5} for bent in arm.slack)


def test_points_of_a_camera_read_back_exactly(tmp_path: Path, records: list[TickRecord]) -> None:
    camera = whole(tmp_path, records).cameras["wrist"]
    views = [record.observation.views[0] for record in records]
    truths = [record.sample.frames[0].truth for record in records]
    np.testing.assert_array_equal(camera.time, [view.time for view in views])
    np.testing.assert_array_equal(camera.received, [record.time for record in records])
    np.testing.assert_array_equal(camera.points_px, [view.points_px for view in views])
    np.testing.assert_array_equal(camera.covariance_px, [view.covariance_px for view in views])
    np.testing.assert_array_equal(camera.true_px, [truth.points_px for truth in truths])
    np.testing.assert_array_equal(camera.T_world_target, [truth.T_world_target for truth in truths])
    assert set(camera.reasons) == {("", "left the image")}
    np.testing.assert_array_equal(camera.found, [view.found for view in views])
    np.testing.assert_array_equal(camera.asked, [view.asked for view in views])
    np.testing.assert_array_equal(camera.window_center_px, [view.windows[0] for view in views])
    np.testing.assert_array_equal(camera.window_half_px, [view.windows[1] for view in views])


def test_errors_count_only_where_a_point_was_found(
    tmp_path: Path, records: list[TickRecord]
) -> None:
    camera = whole(tmp_path, records).cameras["wrist"]
    error = np.linalg.norm(camera.points_px[:, 0] - DESIRED_PX[0], axis=1)
    np.testing.assert_allclose(camera.error_px[:, 0], error)
    assert np.isnan(camera.error_px[:, 1]).all()
    assert np.isnan(camera.drift_px[:, 1]).all()


def test_the_filters_target_reads_back_exactly(tmp_path: Path, records: list[TickRecord]) -> None:
    target = whole(tmp_path, records).target
    given = [record.observation.target for record in records]
    assert target is not None
    np.testing.assert_array_equal(target.velocity, [state.velocity for state in given])
    np.testing.assert_array_equal(target.covariance, [state.covariance for state in given])
    assert target.consistent.all()


def test_every_second_image_is_kept_at_its_exposure(
    tmp_path: Path, records: list[TickRecord]
) -> None:
    kept = list(whole(tmp_path, records).images("wrist"))
    frames = [record.sample.frames[0] for record in records][::2]
    np.testing.assert_allclose([time for time, _ in kept], [frame.time for frame in frames])
    for (_, image), frame in zip(kept, frames, strict=True):
        assert image.shape == frame.image.shape


def test_some_images_can_be_read_alone(tmp_path: Path, records: list[TickRecord]) -> None:
    recording = whole(tmp_path, records)
    times = recording.image_times("wrist")
    some = [time for time, _ in recording.images("wrist", only={0, 3, 99})]
    np.testing.assert_array_equal(some, times[[0, 3]])
    np.testing.assert_array_equal([time for time, _ in recording.images("wrist")], times)
    assert len(recording.image_times("wall")) == 0


def test_a_smooth_image_survives_compression(tmp_path: Path, records: list[TickRecord]) -> None:
    smooth = np.add.outer(np.arange(48), np.arange(64)).astype(np.uint8)
    sample = Sample(0.0, {}, (Frame("wall", 0.0, smooth, {}),))
    whole(tmp_path, [TickRecord(0.0, sample, None, None, {})])
    [(_, image)] = Recording.open(tmp_path).images("wall")
    assert np.abs(image.astype(float) - smooth).max() < 4


def test_what_is_known_of_the_run_reads_back(tmp_path: Path, records: list[TickRecord]) -> None:
    recording = whole(tmp_path, records)
    arm = recording.info.arms["left"]
    assert recording.complete
    assert recording.outcome == DONE
    assert recording.summary == {"max error": 3.5, "note": "fine", "drift": None}
    (event,) = recording.events
    assert (event.time, event.name, event.text) == (2.5, "feature lost", LOST)
    assert (recording.info.cell, recording.info.seed) == (INFO.cell, INFO.seed)
    assert recording.info.text == INFO.text == (tmp_path / "cell.toml").read_text(encoding="utf-8")
    np.testing.assert_array_equal(arm.q_max, [1.0, np.inf])
    np.testing.assert_array_equal(arm.q_min, [-1.0, -np.inf])
    np.testing.assert_array_equal(
        recording.info.cameras["wrist"].matrix, INFO.cameras["wrist"].matrix
    )
    assert recording.duration == records[-1].time


def test_the_summary_stands_beside_the_recording_as_strict_json(
    tmp_path: Path, records: list[TickRecord]
) -> None:
    whole(tmp_path, records)
    data = json.loads(
        (tmp_path / "summary.json").read_text(encoding="utf-8"), parse_constant=pytest.fail
    )
    assert data["outcome"] == {"kind": "completed", "reason": DONE.reason, "time": 1.25}
    assert data["summary"]["drift"] is None


def test_numbers_that_are_not_finite_read_back_as_nan(tmp_path: Path) -> None:
    command = JointCommand(np.array([np.nan, 1.0]), np.full(6, np.inf))
    sample = Sample(0.0, {"left": JointState(0.0, np.zeros(2), np.zeros(2))}, ())
    arm = whole(tmp_path, [TickRecord(0.0, sample, None, None, {"left": command})]).arms["left"]
    np.testing.assert_array_equal(arm.command, [[np.nan, 1.0]])
    assert np.isnan(arm.v_camera).all()
    assert np.isnan(arm.manipulability).all()


def test_a_changing_number_of_points_is_filled_up(tmp_path: Path, rng: np.random.Generator) -> None:
    recorder = recorder_with(tmp_path, [])
    for count in (1, 3):
        view = ImagePoints(
            "wall", float(count), np.ones((count, 2)), np.ones((count, 2, 2)),
            np.ones(count, dtype=bool), ("",) * count,
        )  # fmt: skip
        sample = Sample(float(count), {}, ())
        recorder.tick(TickRecord(float(count), sample, Observation(0.0, (view,)), None, {}))
    recorder.close(DONE, {})
    wall = Recording.open(tmp_path).cameras["wall"]
    assert wall.points_px.shape == (2, 3, 2)
    np.testing.assert_array_equal(wall.found.sum(axis=1), [1, 3])
    np.testing.assert_array_equal(wall.asked, wall.found)  # no windows: all were looked for
    np.testing.assert_array_equal(np.isnan(wall.points_px[..., 0]).sum(axis=1), [2, 0])


def test_an_unfinished_recording_reads_to_its_last_second(
    tmp_path: Path, records: list[TickRecord]
) -> None:
    recorder = recorder_with(tmp_path / "run", records)
    cut = tmp_path / "cut"
    cut.mkdir()
    (cut / "recording.mcap").write_bytes((tmp_path / "run" / "recording.mcap").read_bytes())
    recorder.close(DONE, {})
    recording = Recording.open(cut)
    assert not recording.complete
    assert recording.outcome.kind is OutcomeKind.CUT_OFF
    assert recording.duration > records[-1].time - 1.1


@pytest.mark.parametrize("share", [0.3, 0.6, 0.9, 0.999])
def test_a_cut_file_reads_up_to_the_cut(
    tmp_path: Path, records: list[TickRecord], share: float
) -> None:
    whole(tmp_path, records)
    path = tmp_path / "recording.mcap"
    path.write_bytes(path.read_bytes()[: int(share * path.stat().st_size)])
    recording = Recording.open(tmp_path)
    arm, camera = recording.arms["left"], recording.cameras["wrist"]
    assert not recording.complete
    assert len(arm.time) >= int(0.5 * share * len(records))
    np.testing.assert_array_equal(arm.time, [record.time for record in records[: len(arm.time)]])
    assert len(list(recording.images("wrist"))) <= len(camera.time)


def test_nothing_is_recorded_after_the_end(tmp_path: Path, records: list[TickRecord]) -> None:
    recorder = recorder_with(tmp_path, records)
    recorder.close(DONE, {"a": 1.0})
    recorder.close(Outcome(OutcomeKind.STOPPED, "again", 9.0), {})
    assert Recording.open(tmp_path).outcome == DONE


def test_a_new_run_leaves_nothing_of_the_old(tmp_path: Path, records: list[TickRecord]) -> None:
    whole(tmp_path, records)
    recorder_with(tmp_path, records[:3])
    assert not (tmp_path / "summary.json").exists()


def test_a_run_that_never_ticked_is_readable(tmp_path: Path) -> None:
    recorder_with(tmp_path, []).close(DONE, {})
    recording = Recording.open(tmp_path)
    assert recording.duration == 0.0
    assert recording.cameras["wrist"].error_px.shape == (0, 0)


@pytest.mark.parametrize("content", [None, b"", b"not a recording at all", b"\x89MCAP0\r\n"])
def test_a_folder_without_a_recording_is_named(tmp_path: Path, content: bytes | None) -> None:
    if content is not None:
        (tmp_path / "recording.mcap").write_bytes(content)
    with pytest.raises(InputError) as error:
        Recording.open(tmp_path)
    assert str(tmp_path) in str(error.value)


def test_viewers_find_the_types_they_know(tmp_path: Path, records: list[TickRecord]) -> None:
    from mcap.reader import make_reader

    whole(tmp_path, records)
    with (tmp_path / "recording.mcap").open("rb") as stream:
        summary = make_reader(stream).get_summary()
    schemas = {
        channel.topic: summary.schemas[channel.schema_id].name
        for channel in summary.channels.values()
    }
    assert schemas == {
        "/camera/wrist/calibration": "foxglove.CameraCalibration",
        "/camera/wall/calibration": "foxglove.CameraCalibration",
        "/arm/left/joints": "foxglove.JointStates",
        "/arm/left/state": "vergence.Arm",
        "/camera/wrist/image": "foxglove.CompressedImage",
        "/camera/wrist/annotations": "foxglove.ImageAnnotations",
        "/camera/wrist/features": "vergence.Features",
        "/tf": "foxglove.FrameTransforms",
        "/target": "vergence.Target",
        "/events": "foxglove.Log",
    }
