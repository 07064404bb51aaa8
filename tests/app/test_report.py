"""A report says how the run went, and needs nothing but itself."""

import csv
import re
import shutil
from dataclasses import replace
from pathlib import Path

import made_up_run
import numpy as np
import pytest

from vergence.app import markup
from vergence.app.report import make_report, report, write_report
from vergence.app.table import arm_rows, camera_rows, constraint_rows, run_rows
from vergence.errors import InputError
from vergence.runtime.recording import Recording
from vergence.signals import Outcome, OutcomeKind


@pytest.fixture(scope="module")
def page(recording: Recording) -> str:
    return make_report(recording)


def test_the_page_holds_all_it_shows(page: str) -> None:
    sources = re.findall(r'(?:src|href)="([^"]*)"', page)
    assert sources
    assert all(source.startswith("data:") for source in sources)
    assert "@import" not in page
    assert "url(" not in page


def test_the_page_tells_the_outcome_and_every_part(page: str) -> None:
    for word in ("made-up", "completed", "the target was followed to the end", "Summary"):
        assert word in page
    for heading in ("Camera wrist", "Target", "Arm puma", "Events", "Cell file"):
        assert f"<h2>{heading}</h2>" in page
    assert "the residual is too large" in page
    assert page.count('class="film"') == 1
    assert page.count('<img src="data:image/jpeg') == 5  # the film's first, and the key frames
    assert page.count('<svg class="chart"') == 8


def test_every_image_and_chart_says_what_it_shows(page: str) -> None:
    assert all(re.findall(r'(?:alt|aria-label)="([^"]*)"', page))
    charts = page.count('<svg class="chart"')
    assert page.count("<img") + charts == page.count("<figcaption>")


def test_the_numbers_lie_beside_the_page(recording: Recording, tmp_path: Path) -> None:
    page = report(recording, tmp_path / "report.html")
    assert "signals.csv" in page.read_text(encoding="utf-8")
    with (tmp_path / "signals.csv").open(newline="", encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    joint3 = [float(row["puma.position.joint3"]) for row in rows]
    np.testing.assert_allclose(joint3, recording.arms["puma"].position[:, 2], rtol=1e-8)
    trace = recording.cameras["wrist"]
    lost = np.isnan(trace.error_px[:, 3])
    assert [row["wrist.error_px.3"] == "" for row in rows] == lost.tolist()
    assert [row["wrist.found.3"] for row in rows] == ["0" if gone else "1" for gone in lost]
    assert rows[62]["puma.slack"] == "view=0.103333"
    assert [row["puma.active"] for row in rows] == [
        "; ".join(names) for names in recording.arms["puma"].active
    ]


def test_a_final_error_behind_a_moving_target_is_explained(recording: Recording) -> None:
    trace = recording.cameras["wrist"]
    stationary = np.tile(trace.T_world_target[:1], (len(trace.time), 1, 1))
    moving = stationary.copy()
    moving[:, 0, 3] += 0.1 * trace.time
    told = [
        {row.name: row.note for row in camera_rows(replace(trace, T_world_target=poses))}
        for poses in (stationary, moving)
    ]
    expected = "farthest point from where the law wants it, last image that shows one"
    assert told[0]["final error"] == expected
    assert "moves at 0.1 m/s" in told[1]["final error"]


def test_the_numbers_are_those_of_the_recording(recording: Recording) -> None:
    trace, arm = recording.cameras["wrist"], recording.arms["puma"]
    camera = {row.name: row.value for row in camera_rows(trace)}
    measures = {row.name: row for row in arm_rows(recording.info.arms["puma"], arm)}
    assert camera["final error"] == f"{np.nanmax(trace.error_px[-1]):.2f}"
    assert camera["largest error"] == f"{np.nanmax(trace.error_px):.2f}"
    assert camera["largest drift"] == f"{np.nanmax(trace.drift_px):.2f}"
    assert camera["points found"] == f"{100 * trace.found.mean():.1f}"
    ratio = arm.manipulability.min() / arm.manipulability[0]
    assert measures["least manipulability"].value == f"{ratio:.2f}"
    assert measures["limit clearance P"].value == f"{arm.penalty.min():.2f}"
    fastest = np.abs(arm.velocity).max()
    assert measures["joints: fastest"].value == f"{100 * fastest:.0f}"
    assert "joint3" in measures["joints: fastest"].note


def test_set_points_and_the_joints_that_follow_them_are_told_apart(recording: Recording) -> None:
    info, arm = recording.info.arms["puma"], recording.arms["puma"]
    beyond = replace(
        arm,
        setpoint=np.tile(0.5 * info.q_max, (len(arm.time), 1)),
        setpoint_rate=np.tile(info.rate_max, (len(arm.time), 1)),
        velocity=np.tile(1.04 * info.rate_max, (len(arm.time), 1)),
    )
    measures = {row.name: row for row in arm_rows(info, beyond)}
    assert measures["set-points: fastest"].value == "100"
    assert measures["joints: fastest"].value == "104"
    assert "overshoot" in measures["joints: fastest"].note
    before = replace(arm, setpoint=np.full_like(arm.setpoint, np.nan))  # an older recording
    assert "set-points: closest to a joint limit" not in {
        row.name for row in arm_rows(info, before)
    }


def test_what_gave_way_is_told_with_when_and_by_how_much(recording: Recording) -> None:
    rows = {row.name: row for row in constraint_rows(recording.arms["puma"])}
    arm = recording.arms["puma"]
    pushed = np.mean(["joint rates" in names for names in arm.active])
    assert rows["joint rates"].value == f"{100 * pushed:.1f}"
    assert rows["joint rates"].note == "of the time"
    assert rows["view"].note == (
        "of the time; relaxed in 14 ticks from 2.03 s on, by up to 0.12 1/s at 2.47 s"
    )


def test_units_are_read_off_names(recording: Recording) -> None:
    named = replace(
        recording, summary={"reaction_ms": 12.345, "far_m": 2.0, "near_m": 2e-3, "law": "optimal"}
    )
    rows = {row.name: (row.value, row.unit) for row in run_rows(named)}
    assert rows["reaction"] == ("12.3", "ms")
    assert rows["far"] == ("2", "m")
    assert rows["near"] == ("2", "mm")
    assert rows["law"] == ("optimal", "")


def test_names_cannot_break_the_page(recording: Recording) -> None:
    sly = "<script>alert(1)</script>"
    outcome = Outcome(OutcomeKind.STOPPED, sly, 1.0)
    info = replace(recording.info, cell=sly, text=sly)
    assert sly not in make_report(replace(recording, info=info, outcome=outcome))


def test_a_run_that_was_cut_off_has_a_report(run_folder: Path, tmp_path: Path) -> None:
    whole = (run_folder / "recording.mcap").read_bytes()
    (tmp_path / "recording.mcap").write_bytes(whole[: len(whole) // 2])
    page = write_report(tmp_path).read_text(encoding="utf-8")
    assert "cut off" in page
    assert "Arm puma" in page


def test_a_run_that_never_ticked_has_a_report(tmp_path: Path) -> None:
    made_up_run.record(tmp_path, duration=0.0)
    assert "made-up" in write_report(tmp_path).read_text(encoding="utf-8")


def test_a_report_can_be_made_where_the_run_was_moved(run_folder: Path, tmp_path: Path) -> None:
    moved = shutil.copytree(run_folder, tmp_path / "elsewhere")
    assert write_report(moved) == moved / "report.html"


def test_no_report_without_a_recording(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"recording\.mcap"):
        write_report(tmp_path)


def test_an_arm_that_is_called_arm_is_no_arm_arm() -> None:
    assert markup.titled("Arm", "puma") == "Arm puma"
    assert markup.titled("Arm", "arm") == "Arm"
    assert markup.titled("Camera", "camera") == "Camera"
