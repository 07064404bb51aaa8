"""At the command line, what cannot be used ends in one sentence and exit code 2."""

import sys
from collections.abc import Callable
from pathlib import Path

import made_up_run
import pytest
from hypothesis import given
from hypothesis import strategies as st
from untrusted import mutants

from vergence.app.main import main
from vergence.places import CELL, CELLS, RECORDING

GOOD = (CELLS / "puma560" / CELL).read_bytes()
Run = Callable[..., tuple[int, str]]


@pytest.fixture
def run(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Run:
    """Return a command's exit code, and what it wrote on stderr."""

    def command(*arguments: str | Path) -> tuple[int, str]:
        monkeypatch.setattr(sys, "argv", ["vergence", *map(str, arguments)])
        try:
            main()
        except SystemExit as end:
            return int(str(end.code)), capsys.readouterr().err
        return 0, capsys.readouterr().err

    return command


def refused(answer: tuple[int, str]) -> bool:
    """Whether a command refused what it was given; if so, in one sentence."""
    code, said = answer
    assert code in (0, 2), said
    if code == 2:
        assert said.count("\n") == 1, said
        assert said.startswith("vergence: "), said
        assert len(said) < 2000, said
    return code == 2


@given(st.data())
def test_a_damaged_cell_is_refused_in_one_sentence_or_taken(
    run: Run, tmp_path: Path, data: st.DataObject
) -> None:
    cell, text = tmp_path / "cell.toml", data.draw(mutants(GOOD))
    cell.write_bytes(text)
    refused(run("plan", cell))  # puma560 has no goal to plan for, so that nothing else is done


@given(st.data())
def test_a_damaged_recording_is_refused_in_one_sentence_or_reported(
    run: Run, tmp_path: Path, recording: bytes, data: st.DataObject
) -> None:
    good = recording[:2000]  # whatever is left of it is cut off
    (tmp_path / RECORDING).write_bytes(data.draw(mutants(good)))
    refused(run("report", tmp_path))


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    folder = made_up_run.record(tmp_path_factory.mktemp("good"), duration=0.1, images=False)
    return (folder / RECORDING).read_bytes()


@pytest.mark.parametrize("command", ["report", "watch"])
@pytest.mark.parametrize("data", [b"", b"\x89MCAP0\r\n", b"\0" * 100_000, b"x"])
def test_what_is_no_recording_is_refused(
    run: Run, tmp_path: Path, command: str, data: bytes
) -> None:
    (tmp_path / RECORDING).write_bytes(data)
    assert refused(run(command, tmp_path, *(["--no-browser"] if command == "watch" else [])))


@pytest.mark.parametrize(
    "setting",
    [
        "duration_s=1e30",
        "cameras.wrist.latency_frames=" + "9" * 4300,
        "cameras.wrist.latency_frames=" + "9" * 5000,
        "perception.budget=1e30",
        "law.Q=" + "[" * 3000,
        "arms.puma.start_deg=nan",
        "x" * 20_000 + "=1",
        ".".join("a" * 2000) + "=1",
        "name=$\\bad{$",
        "inner_rate_hz=1e400",
        "=",
        "law",
        "target.model=\0",
        "target.model=" + "x" * 900,
    ],
)
def test_a_setting_that_no_cell_takes_is_refused(run: Run, setting: str) -> None:
    assert refused(run("run", "puma560", "--no-images", "--set", setting))


def test_a_recording_that_was_cut_off_is_reported_and_says_so(
    run: Run, tmp_path: Path, recording: bytes
) -> None:
    (tmp_path / RECORDING).write_bytes(recording[: len(recording) * 3 // 4])
    assert not refused(run("report", tmp_path))
    assert "The recording is incomplete" in (tmp_path / "report.html").read_text()
