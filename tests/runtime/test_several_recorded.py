"""What is kept of several targets: in memory, in a recording, in its report and on the page."""

from dataclasses import replace

import numpy as np
import pytest

import vergence as vg
from vergence.app.marks_legend import marks_legend
from vergence.app.recorded_poses import RecordedPoses
from vergence.app.recorded_world import RecordedWorld
from vergence.app.report import make_report
from vergence.app.watch.playback import Playback
from vergence.runtime import Recorder, Run
from vergence.runtime.recording import Recording

_FOLLOW = {"kind": "follow", "arm": "follower", "camera": "hand"}


@pytest.fixture(scope="module")
def both(tmp_path_factory: pytest.TempPathFactory) -> tuple[Run, Recording]:
    """A run in which each target is the task's in turn, and its recording."""
    folder = tmp_path_factory.mktemp("recorded") / "run"
    tasks = [
        {**_FOLLOW, "target": "block", "until": {"kind": "time", "time_s": 2.0}},
        {**_FOLLOW, "target": "wedge"},
    ]
    still = {"motion": {"kind": "stationary"}}
    line = {"motion": {"kind": "line", "velocity_m_s": [0.0, 0.0, 0.02], "distance_m": 1.0}}
    place = {"position_m": [1.05, -0.12, 0.9]}
    run = vg.run(
        "two_blocks",
        images=False,
        duration_s=5.0,
        tasks=tasks,
        targets={"block": still, "wedge": {**place, **line}},
        perception={"start_error_m": 0.0, "start_error_deg": 0.0},
        listeners=[Recorder(folder)],
    )
    return run, Recording.open(folder)


def test_what_is_read_is_what_was_recorded(both: tuple[Run, Recording]) -> None:
    run, recording = both
    assert run.outcome.succeeded, run.outcome
    assert recording.info.targets == ("block", "wedge")
    assert recording.others.keys() == run.others.keys() == {"block", "wedge"}
    for name, other in run.others.items():
        read = recording.others[name]
        assert other.target is not None
        assert read.target is not None
        assert np.allclose(read.target.T_world_target, other.target.T_world_target)
        for camera, trace in other.cameras.items():
            assert np.array_equal(read.cameras[camera].found, trace.found)
            assert np.allclose(read.cameras[camera].true_px, trace.true_px, equal_nan=True)
    for key in ("final_target_wedge_error_m", "max_target_block_error_deg"):
        assert recording.summary[key] == pytest.approx(run.summary[key])
    assert run.summary["max_target_wedge_error_m"] < 0.02


def test_a_target_is_another_only_while_the_task_is_not_about_it(
    both: tuple[Run, Recording],
) -> None:
    wedge, block = (both[0].others[name].cameras["hand"].time for name in ("wedge", "block"))
    assert len(wedge)
    assert len(block)
    assert wedge.max() <= block.min()
    assert len(wedge) + len(block) == len(both[0].cameras["hand"].time)


def test_every_target_is_played_back_where_it_was(both: tuple[Run, Recording]) -> None:
    recording = both[1]
    world = RecordedWorld.of(recording.info)
    assert isinstance(world, RecordedWorld)
    poses = RecordedPoses(recording)
    for time in (0.0, 1.5, 2.2, 4.9):
        world.place(poses.joints(time), poses.targets(time))
        expected = {"block": [0.95, 0.0, 0.85], "wedge": [1.05, -0.12, 0.9 + 0.02 * time]}
        for name, place in expected.items():
            assert np.allclose(world.world.target_pose(name)[:3, 3], place, atol=2e-3), (name, time)


def test_report_table_and_page_tell_of_each(both: tuple[Run, Recording]) -> None:
    run, recording = both
    page = make_report(recording)
    for name in ("wedge", "block"):
        assert f"Target {name}" in page
        for what in ("position", "rotation"):
            assert f"final target {name} error, {what}" in page
        assert f"target {name}" in [c.partition(".")[0] for c in _columns(run)]
    playback = Playback(recording, None)
    keys = [plot.key for plot in playback.plots]
    assert {"target_mm wedge", "target_mm block"} <= set(keys)
    (hand,) = (view for view in playback.views(1.0) if view.camera == "hand")
    (wedge,) = hand.header["others"]
    assert len(wedge["points"]) == 6


def test_the_marks_of_every_target_are_explained(both: tuple[Run, Recording]) -> None:
    recording = both[1]
    own = recording.cameras["right"]
    none = replace(own, found=np.zeros_like(own.found))
    unseen = replace(recording, cameras={**recording.cameras, "right": none})
    assert unseen.others["wedge"].cameras["right"].found.any()
    assert "tracked" in marks_legend(unseen, "right")
    nothing = replace(unseen, others={})
    assert "tracked" not in marks_legend(nothing, "right")


def _columns(run: Run) -> list[str]:
    from vergence.runtime.results.data_frame import tick_columns

    return list(tick_columns(run))
