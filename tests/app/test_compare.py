"""`vergence compare` and `vergence map`: tables, pages, images and data of many runs."""

import csv
import json
import re
import sys
from collections.abc import Callable
from pathlib import Path

import cv2
import pytest

from vergence.app.campaign import Campaign, prepare, reasons_table
from vergence.app.main import main
from vergence.app.options.campaign import CompareOptions
from vergence.experiments import (
    Ending,
    Executor,
    ResultsFile,
    Trial,
    TrialResult,
    WorkersLostError,
)

Command = Callable[..., int]
QUICK = ["--workers", "1", "--set", "task.feature_count=4", "--set", "duration_s=0.6"]
COMPARE = ["compare", "puma560", "--laws", "image_based,constrained", "--starts", "2", *QUICK]
MAP = [
    "map",
    "puma560",
    "--laws",
    "image_based,constrained",
    "--extent",
    "0.05",
    "--steps",
    "2",
    *QUICK,
]


@pytest.fixture
def command(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Command:
    """Run the command line in an empty folder; return its exit code."""
    monkeypatch.chdir(tmp_path)

    def run(*arguments: str) -> int:
        monkeypatch.setattr(sys, "argv", ["vergence", *arguments])
        with pytest.raises(SystemExit) as end:
            main()
        code = end.value.code
        return code if isinstance(code, int) else 0

    return run


def rows_of(path: str) -> list[dict[str, str]]:
    with Path(path).open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def test_laws_are_compared_in_one_table(command: Command, capsys: object) -> None:
    assert command(*COMPARE, "--json", "--out", "c") == 0
    answer = json.loads(capsys.readouterr().out)
    assert [law["law"] for law in answer["laws"]] == ["image_based", "constrained"]
    counts = (
        "converged",
        "off_goal",
        "joint_limit",
        "collision",
        "out_of_view",
        "singular",
        "lost",
    )
    for law in answer["laws"]:
        assert sum(law[name] for name in counts) == law["starts"] == 2
    assert sum(answer["made_in"].values()) == 4
    assert answer["made_in"].keys() <= {"kernel", "loop"}  # by what is compiled
    assert answer["runs_per_cpu_s"] > 0
    rows = rows_of(answer["data"])
    assert [row["law"] for row in rows] == ["image_based"] * 2 + ["constrained"] * 2
    assert {"ending", "time_s", "path_m", "reason"} <= rows[0].keys()
    page = Path(answer["report"]).read_text(encoding="utf-8")
    assert page.count("<img") == 2
    assert "2 laws from 2 starts" in page


def test_a_second_run_in_the_same_folder_continues_and_says_the_same(
    command: Command, capsys: object
) -> None:
    assert command(*COMPARE, "--out", "c") == 0
    first = capsys.readouterr().out
    results = Path("c/results.jsonl").read_bytes()
    assert command(*COMPARE, "--out", "c") == 0
    # But for how fast it was, as nothing was run.
    again = re.sub(r"[\d.]+ runs per CPU second, set-up included; ", "", first)
    assert again != first
    assert capsys.readouterr().out == again
    assert Path("c/results.jsonl").read_bytes() == results
    assert command(*COMPARE, "--seed", "5", "--out", "c") == 2
    assert "another campaign" in capsys.readouterr().err


def test_a_campaign_whose_runs_are_all_refused_has_no_speed() -> None:
    assert Campaign((), 48.9).in_words == "no run was possible"


def test_what_is_done_is_kept_when_the_user_stops_it(
    command: Command, capsys: object, monkeypatch: pytest.MonkeyPatch
) -> None:
    add, done = ResultsFile.add, []

    def stop_at_the_third(results_file: ResultsFile, result: TrialResult) -> None:
        if len(done) == 2:
            raise KeyboardInterrupt
        done.append(result.key)
        add(results_file, result)

    monkeypatch.setattr(ResultsFile, "add", stop_at_the_third)
    assert command(*COMPARE, "--out", "c") == 1
    assert "--out c to resume" in capsys.readouterr().err
    assert len(Path("c/results.jsonl").read_text().splitlines()) == 3
    monkeypatch.setattr(ResultsFile, "add", add)
    assert command(*COMPARE, "--out", "c") == 0
    assert len(Path("c/results.jsonl").read_text().splitlines()) == 5


def test_workers_that_die_end_in_a_message(
    command: Command, capsys: object, monkeypatch: pytest.MonkeyPatch
) -> None:
    def lose(*_: object) -> None:
        raise WorkersLostError([Trial("own/3", {})], "something killed 4 workers")

    monkeypatch.setattr(Executor, "run", lose)
    assert command(*COMPARE, "--out", "c") == 1
    said = capsys.readouterr().err
    assert "run own/3: something killed 4 workers; repeat the command" in said
    assert "--out c to resume" in said


@pytest.mark.parametrize(
    ("over", "speeds", "columns", "runs"),
    [
        ("places", "0.1", {"x_m", "y_m"}, 4),
        ("headings", "0.1,0.2", {"heading_deg", "speed_m_s", "distance_m"}, 4),
    ],
)
def test_a_region_is_mapped_to_an_image_and_a_table(
    command: Command, capsys: object, over: str, speeds: str, columns: set[str], runs: int
) -> None:
    assert command(*MAP, "--over", over, "--speeds", speeds, "--json", "--out", "m") == 0
    answer = json.loads(capsys.readouterr().out)
    assert [law["law"] for law in answer["laws"]] == ["image_based", "constrained"]
    for law in answer["laws"]:
        assert law["runs"] == runs == sum(law["endings"].values())
    rows = rows_of(answer["data"])
    assert len(rows) == 2 * runs
    assert columns <= rows[0].keys()
    assert cv2.imread(answer["image"]) is not None
    assert "Where it works" in Path(answer["report"]).read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["compare", "puma560", "--laws", ","], "--laws"),
        (["compare", "puma560", "--laws", "imagebased"], "did you mean image_based"),
        (["compare", "puma560", "--laws", "nope"], "vergence: --laws: given nope; allowed: "),
        (["compare", "puma560", "--vary", "nope"], "vergence: --vary: given nope; allowed: "),
        (["map", "gantry", "--over", "headings"], "vergence: --over: given headings, but the task"),
        (["map", "puma560", "--over", "starts"], "headings, places"),
        (["map", "puma560", "--speeds", "0,1"], "--speeds"),
        (["map", "no_such_cell"], "a built-in cell"),
        (["compare", "puma560", "--scheduler", "nope"], "vergence: --scheduler: given nope;"),
        (["map", "puma560", "--scheduler", "tcp://127.0.0.1:1"], "where nothing answers"),
    ],
)
def test_a_mistake_is_one_message(
    command: Command, capsys: object, arguments: list[str], said: str
) -> None:
    assert command(*arguments) == 2
    captured = capsys.readouterr()
    assert said in captured.err
    assert captured.out == ""
    assert captured.err.count("\n") == 1


def test_a_scheduler_that_is_none_is_refused_before_anything_is_done(
    command: Command, tmp_path: Path
) -> None:
    assert command("compare", "nope", "--scheduler", "nope", "--out", str(tmp_path / "out")) == 2
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("name", ["compare", "map"])
def test_the_help_has_an_example(command: Command, capsys: object, name: str) -> None:
    assert command(name, "--help") == 0
    assert f"Example: vergence {name}" in capsys.readouterr().out


def test_a_run_that_ends_off_the_goal_says_how_far_off() -> None:
    result = TrialResult(
        "own/1", {"law": "own"}, Ending.OFF_GOAL, "ran for 2 s with the target in view", 2.0, None,
        12.345, 20.0, 0.1, 0.0, False, (0, 0, 0), (0, 0, 0), (0, 0), (0, 0),
    )  # fmt: skip
    table = reasons_table([result], "{law}")
    assert "the farthest point is 12.3 px off at the end" in table
    assert "in view" not in table


@pytest.mark.parametrize(
    ("command_name", "settings", "stated", "tolerance_px"),
    [
        ("compare", [], None, 5.0),
        ("compare", ['target.motion={kind="stationary"}'], None, 2.0),
        ("compare", [], 3.0, 3.0),
        ("map", [], None, 2.0),
    ],
)
def test_a_target_that_moves_may_be_followed_with_some_lag(
    tmp_path: Path, command_name: str, settings: list[str], stated: float, tolerance_px: float
) -> None:
    options = CompareOptions(cell="ur5", settings=settings, out=tmp_path, tolerance_px=stated)
    assert prepare(command_name, options)[1].tolerance_px == tolerance_px
