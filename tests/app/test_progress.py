"""Long work says how far it is, in a pipe too, and how many kernels it has to compile first."""

import time

import pytest
from numba import njit

from vergence.app import heartbeat
from vergence.app.progress import bar, working


@pytest.fixture(autouse=True)
def often(monkeypatch: pytest.MonkeyPatch) -> None:
    """A line every hundredth of a second, not every ten."""
    monkeypatch.setattr(heartbeat, "PERIOD_S", 0.01)


def wait_for(text: str, capsys: pytest.CaptureFixture[str]) -> None:
    end, said = time.monotonic() + 10.0, ""
    while text not in said:
        assert time.monotonic() < end, said
        time.sleep(0.005)
        said += capsys.readouterr().err


def test_a_bar_in_a_pipe_says_how_far_it_is(capsys: pytest.CaptureFixture[str]) -> None:
    with bar("{task.completed} of {task.total} runs") as progress:
        task = progress.add_task("runs", total=8)
        progress.update(task, completed=2)
        wait_for("runs: 2 of 8 runs, 0 s so far", capsys)
    time.sleep(0.05)
    capsys.readouterr()
    time.sleep(0.05)
    assert capsys.readouterr().err == ""  # it has stopped


def test_what_is_left_is_told_at_the_pace_of_the_whole(capsys: pytest.CaptureFixture[str]) -> None:
    with bar("{task.completed} of {task.total} runs") as progress:
        task = progress.add_task("runs", total=4000)
        time.sleep(0.2)
        for _ in range(2):  # two at once, after a wait
            progress.advance(task)
        wait_for("runs: 2 of 4000 runs, 0 s so far, ", capsys)
        time.sleep(0.05)
        words = capsys.readouterr().err.splitlines()[-1]
        left = float(words.removesuffix(" s left").rpartition(" ")[2])
        assert left > 300.0  # 0.2 s for two: 400 s


def test_compilation_is_told_while_it_lasts(capsys: pytest.CaptureFixture[str]) -> None:
    with working("setting up"):
        wait_for("setting up, 0 s so far", capsys)
        njit(lambda x: x + 1)(1)
        wait_for("setting up: compiling kernels, once on this computer, 1 so far, 0 s", capsys)
