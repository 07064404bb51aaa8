"""Two runs side by side: every number of both, and each signal as a curve a run."""

import re
from dataclasses import replace
from html import escape
from pathlib import Path

import accessibility
import made_up_run
import numpy as np
import pytest
from browser import Browser

from vergence.app.figures.pair import arms_chart, errors_chart
from vergence.app.recorded_images import camera_images
from vergence.app.report_pair import make_pair, write_pair
from vergence.app.table import camera_rows
from vergence.errors import InputError
from vergence.runtime.recording import Recording
from vergence.signals import Outcome, OutcomeKind, TaskOutcome


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Recording]:
    folder = tmp_path_factory.mktemp("pair")
    lengths = {"slow": 6.0, "quick": 3.0}
    return {
        name: Recording.open(made_up_run.record(folder / name, duration=length))
        for name, length in lengths.items()
    }


def test_the_table_has_the_numbers_of_both(runs: dict[str, Recording]) -> None:
    page = make_pair(runs, dict.fromkeys(runs, ""))
    for run in runs.values():
        for row in camera_rows(run.cameras["wrist"]):
            assert f'<td class="number">{row.value}</td>' in page
            assert escape(row.note) in page
    assert page.count('class="film"') == 2
    assert page.count('class="marks"') == 2  # below each film what its marks mean


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_axe_finds_nothing_to_complain_of(
    runs: dict[str, Recording], tmp_path: Path, scheme: str
) -> None:
    page = tmp_path / "pair.html"
    page.write_text(make_pair(runs, dict.fromkeys(runs, "")), encoding="utf-8")
    browser = Browser(tmp_path / "chromium")
    browser.open(page.as_uri())
    browser.wait("document.readyState === 'complete'")
    found = accessibility.complaints(browser, scheme)
    browser.close()
    assert found == []


def test_each_signal_is_a_curve_a_run(runs: dict[str, Recording]) -> None:
    errors = errors_chart({name: run.cameras["wrist"] for name, run in runs.items()})
    arms = arms_chart(
        {name: (run.info.arms["puma"], run.arms["puma"]) for name, run in runs.items()}
    )
    assert errors is not None
    assert arms is not None
    for panel in (*errors.panels, *arms.panels):
        assert [curve.label for curve in panel.curves] == ["slow", "quick"]
        assert "(" in panel.title
    trace = runs["quick"].cameras["wrist"]
    np.testing.assert_allclose(errors.panels[0].curves[1].y, np.nanmax(trace.error_px, axis=1))
    assert errors.x_high == runs["slow"].cameras["wrist"].time[-1]


def test_films_of_the_robots_and_how_each_task_ended_stand_side_by_side(
    runs: dict[str, Recording], monkeypatch: pytest.MonkeyPatch
) -> None:
    film = camera_images(runs["quick"], "wrist").film
    monkeypatch.setattr("vergence.app.report_pair.robot_film", lambda run: film)
    ended = [Outcome(OutcomeKind.REACHED, "there", time) for time in (1.0, 2.5)]
    tasks = tuple(TaskOutcome(name="advance", begun=0.0, outcome=outcome) for outcome in ended)
    several = {
        name: replace(run, outcome=replace(run.outcome, tasks=tasks)) for name, run in runs.items()
    }
    page = make_pair(several, dict.fromkeys(runs, ""))
    assert page.count('class="film"') == 4
    assert "the robot, slow" in page
    for line in ("1. advance</th>", "2. advance</th>"):
        assert page.count(line) == 1
    assert page.count("reached, 2.50 s</td>") == 2


def test_the_numbers_of_both_lie_beside_the_page(runs: dict[str, Recording]) -> None:
    page = write_pair(runs["slow"].folder, runs["quick"].folder)
    files = re.findall(r"report-against-quick-\d\.csv", page.read_text(encoding="utf-8"))
    assert files == ["report-against-quick-1.csv", "report-against-quick-2.csv"]
    for file, run in zip(files, runs.values(), strict=True):
        with page.with_name(file).open(encoding="utf-8") as stream:
            assert len(stream.readlines()) == 1 + len(run.times)


def test_runs_in_folders_of_one_name_are_told_apart(tmp_path: Path) -> None:
    folders = [tmp_path / one / "run" for one in ("a", "b")]
    for folder in folders:
        made_up_run.record(folder, duration=0.5)
    page = write_pair(*folders).read_text(encoding="utf-8")
    assert f"1: {folders[0]}" in page
    assert f"2: {folders[1]}" in page
    assert not re.findall(r'(?:src|href)="(?!data:)', page)


def test_what_only_one_of_the_runs_has_is_named(runs: dict[str, Recording]) -> None:
    slow, quick = runs.values()
    assert "not compared" not in make_pair(runs, dict.fromkeys(runs, ""))
    renamed = replace(quick, cameras={"wall": quick.cameras["wrist"]}, arms={"other": _arm(quick)})
    info = replace(quick.info, arms={"other": next(iter(quick.info.arms.values()))})
    page = make_pair(
        {"slow": slow, "quick": replace(renamed, info=info)}, {"slow": "", "quick": ""}
    )
    arm = next(iter(slow.arms))
    assert (
        "Only in one of the runs, so not compared: "
        f"camera wrist and arm {arm} of slow; camera wall and arm other of quick." in page
    )


def _arm(run: Recording) -> object:
    return next(iter(run.arms.values()))


def test_a_second_run_without_a_recording_is_named(
    runs: dict[str, Recording], tmp_path: Path
) -> None:
    with pytest.raises(InputError, match=r"recording\.mcap"):
        write_pair(runs["slow"].folder, tmp_path)
