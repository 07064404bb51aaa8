"""Long work says how far it is, in a pipe too, and how many kernels it has to compile first."""

import sys
import time
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from typing import Any

import pytest
from numba import njit
from numba.core import event

from vergence.app import heartbeat
from vergence.app.compilations import Compilations
from vergence.app.durations import remember_s, usual_s
from vergence.app.progress import bar, working
from vergence.experiments.workers import Workers


@pytest.fixture(autouse=True)
def often(monkeypatch: pytest.MonkeyPatch) -> None:
    """A line every hundredth of a second, not every ten."""
    monkeypatch.setattr(heartbeat, "FIRST_S", 0.01)
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
            progress.update(task, advance=1)
        wait_for("runs: 2 of 4000 runs, 0 s so far, ", capsys)
        time.sleep(0.05)
        words = capsys.readouterr().err.splitlines()[-1]
        left = float(words.removesuffix(" s left").rpartition(" ")[2])
        assert left > 300.0  # 0.2 s for two: 400 s


def test_what_compiling_takes_does_not_count_in_the_pace(
    capsys: pytest.CaptureFixture[str],
) -> None:
    with bar("{task.completed} of {task.total} runs") as progress, Compilations() as beside:
        task = progress.add_task("runs", total=1000)
        event.start_event("numba:compile")
        wait_for(
            "runs: 0 of 1000 runs, 0 s so far, compiling kernels, once on this computer, usually",
            capsys,
        )
        event.end_event("numba:compile")
        assert beside.count == 1
        assert not beside.under_way
        time.sleep(0.05)
        progress.update(task, advance=1)
        left_s = float(progress.rest(progress.tasks[0]).removesuffix(" s left"))
        assert left_s < 1.0 + 999.0 * (progress.tasks[0].elapsed - beside.spent_s)
        progress.begin()
        progress.update(task, advance=1)
        from_here = progress.rest(progress.tasks[0]).removeprefix("under ")
        from_here_s = float(from_here.removesuffix(" s left"))
        assert from_here_s < left_s


def test_an_estimate_counts_down_until_the_next_step_makes_a_new_one() -> None:
    with bar("") as progress:
        task = progress.add_task("runs", total=2)
        time.sleep(1.0)
        progress.update(task, advance=1)
        first = progress.rest(progress.tasks[0])
        time.sleep(0.6)
        later = progress.rest(progress.tasks[0])
        assert (first, later) == ("1 s left", "under 1 s left")
        time.sleep(3.0)
        assert progress.rest(progress.tasks[0]) == "takes longer than estimated"
        progress.update(task, advance=1)
        assert progress.rest(progress.tasks[0]) == ""  # all is done


def test_work_that_was_done_before_says_from_its_first_second_how_long_it_took(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert usual_s("writing it of one cell") is None
    remember_s("writing it of one cell", 7.0)
    with working("writing it", "of one cell"):
        wait_for("writing it, 7 s the last time, 0 s so far", capsys)
    assert usual_s("writing it of one cell") < 1.0
    assert usual_s("writing it of another") is None


def test_a_bar_estimates_by_the_last_time_until_that_is_over_and_by_its_pace_then() -> None:
    now = 0.0
    with bar("") as progress:
        progress.get_time = lambda: now
        task = progress.add_task("a study", total=100)
        progress.expect(task, 0.9)
        assert progress.rest(progress.tasks[0]) == "1 s left"
        now = 0.001
        progress.update(task, advance=1)
        assert progress.rest(progress.tasks[0]) == "1 s left"
        now = 3.2
        assert progress.rest(progress.tasks[0]) == "takes longer than estimated"
        progress.update(task, advance=1)
        assert float(progress.rest(progress.tasks[0]).removesuffix(" s left")) > 40.0
        progress.expect(task, 1e4)
        assert progress.begin() > 3.0
        assert float(progress.rest(progress.tasks[0]).removesuffix(" s left")) < 1e3


def test_what_took_how_long_is_kept_of_the_newest_and_no_file_of_ours_is_an_error(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.setattr("vergence.app.durations._MOST", 2)
    for number, name in enumerate(("first", "second", "third")):
        remember_s(name, number)
    assert [usual_s(name) for name in ("first", "second", "third")] == [None, 1.0, 2.0]
    for broken in ("[1, 2", "[1, 2]", '{"third": "long"}', '{"third": null}'):
        (tmp_path / "vergence" / "durations.json").write_text(broken)
        assert usual_s("third") is None
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "vergence" / "durations.json"))
    remember_s("third", 1.0)
    assert usual_s("third") is None


def compile_twice(_: int) -> None:
    kernel = njit(lambda x: x + 1)
    kernel(1)
    kernel(1.0)
    time.sleep(0.05)


def test_what_workers_compile_is_told_and_does_not_count_in_the_pace() -> None:
    with bar("") as progress, Workers(2) as workers:
        progress.add_task("runs", total=4)
        assert len(list(workers.share_out(compile_twice, range(4)))) == 4
        words = progress._compilations
        assert words.words().endswith("usually within two minutes: 1 so far in the workers")
        assert words.spent_s > 0.0
        assert not words.under_way


def test_compilation_is_told_while_it_lasts(capsys: pytest.CaptureFixture[str]) -> None:
    with working("setting up"):
        wait_for("setting up, 0 s so far", capsys)
        njit(lambda x: x + 1)(1)
        wait_for("setting up: compiling kernels, once on this computer, usually within two", capsys)


def test_kernels_of_imported_modules_that_are_not_kept_are_those_to_be_compiled_at_most(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    def kernel(name: str) -> Any:
        path = tmp_path / f"{name}.py"
        path.write_text("def kernel(x):\n    return x + 1\n")
        spec = spec_from_file_location(f"vergence.{name}", path)
        assert spec is not None
        assert spec.loader is not None
        module: Any = module_from_spec(spec)
        spec.loader.exec_module(module)
        module.kernel = njit(cache=True)(module.kernel)
        monkeypatch.setitem(sys.modules, f"vergence.{name}", module)
        return module.kernel

    for name in [name for name in sys.modules if name.startswith("vergence.")]:
        monkeypatch.delitem(sys.modules, name)
    kept, first, other = map(kernel, ("kept", "first", "other"))
    kept(1)
    monkeypatch.setitem(vars(sys.modules["vergence.kept"]), "kernel", kernel("kept"))
    with Compilations() as seen:
        assert seen.words().endswith(": 0 of at most 2")
        first(1)
        assert seen.words().endswith(": 1 of at most 2")
        other(1)
        assert seen.words().endswith(": 2 of at most 2")
