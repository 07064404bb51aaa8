"""`vergence plan` draws a path, or says why there is none, and moves nothing."""

import csv
import json
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from vergence.app.main import main

Command = Callable[..., int]


@pytest.fixture
def command(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Command:
    monkeypatch.chdir(tmp_path)

    def run(*arguments: str) -> int:
        monkeypatch.setattr(sys, "argv", ["vergence", "plan", *arguments])
        with pytest.raises(SystemExit) as end:
            main()
        code = end.value.code
        return code if isinstance(code, int) else 0

    return run


def test_a_path_is_drawn_and_its_joints_written(
    command: Command, capsys: pytest.CaptureFixture[str]
) -> None:
    assert command("gantry", "--no-images", "--out", "here") == 0
    assert "path found" in capsys.readouterr().out
    files = {path.name for path in Path("here").iterdir()}
    assert files == {"report.html", "image.svg", "joints.svg", "space.svg", "joints.csv"}
    with Path("here/joints.csv").open() as stream:
        rows = list(csv.reader(stream))
    assert rows[0] == ["time_s", *(f"joint{k}" for k in range(1, 7))]
    values = np.array(rows[1:], dtype=np.float64)
    np.testing.assert_allclose(values[0, 1:4], [0.595, -0.489, -0.221], atol=1e-6)
    assert (np.diff(values[:, 0]) >= 0).all()
    assert np.abs(np.diff(values[:, 1:], axis=0)).max() < 0.03


def test_the_report_of_a_run_is_not_written_over(
    command: Command, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("run").mkdir()
    Path("run/recording.mcap").touch()
    for words in (("gantry",), ("gantry", "--no-images")):
        assert command(*words, "--out", "run") == 2
        said = capsys.readouterr().err
        assert (
            said == "vergence: --out: given run, which holds a recording; allowed: another folder\n"
        )
    assert [path.name for path in Path("run").iterdir()] == ["recording.mcap"]


def test_json_is_one_object_with_the_paths_numbers(
    command: Command, capsys: pytest.CaptureFixture[str]
) -> None:
    assert command("gantry", "--no-images", "--json", "--planner", "potential_field") == 0
    answer = json.loads(capsys.readouterr().out)
    assert (answer["command"], answer["cell"], answer["found"]) == ("plan", "gantry", True)
    assert answer["planner"] == "potential field"
    assert answer["summary"]["image_margin_px"] > 0
    assert answer["summary"]["joint_margin"] > 0
    assert Path(answer["report"]).is_file()


@pytest.mark.parametrize("as_json", [False, True])
def test_no_path_is_a_failure_with_the_reason(
    command: Command, capsys: pytest.CaptureFixture[str], as_json: bool
) -> None:
    far = ("gantry", "--no-images", "--set", "task.distance_m=3")
    assert command(*far, *(["--json"] if as_json else [])) == 1
    out = capsys.readouterr().out
    reason = json.loads(out)["reason"] if as_json else out
    assert "limit" in reason or "reach" in reason
    assert not Path("runs").exists()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("puma560",), "task.kind"),
        (("gantry", "--planner", "optimized"), "potential_field"),
        (("gantri",), "did you mean gantry?"),
    ],
)
def test_a_mistake_is_one_message_and_exit_code_two(
    command: Command, capsys: pytest.CaptureFixture[str], arguments: tuple[str, ...], words: str
) -> None:
    assert command(*arguments) == 2
    written = capsys.readouterr()
    assert words in written.err
    assert written.out == ""
