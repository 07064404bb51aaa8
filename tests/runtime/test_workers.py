"""Processes that share tasks: nothing is lost when one dies, and none outlives its work."""

import logging
import os
import signal
import subprocess
import sys
import time
from functools import partial
from multiprocessing import active_children
from pathlib import Path

import numba
import psutil
import pytest

from vergence.cell import load_cell
from vergence.experiments import CellSource, Executor, Trial, WorkersLostError
from vergence.experiments.worker import IMPORTED
from vergence.experiments.workers import DEATHS, DeadlyTaskError, Workers


def square(number: int) -> int:
    if number < 0:
        raise ValueError(f"{number} is below zero")
    return number * number


def square_once_dead(folder: Path, number: int) -> int:
    """Die at 3 the first time."""
    mark = folder / "died"
    if number == 3 and not mark.exists():
        mark.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return square(number)


def die_at_3(number: int) -> int:
    if number == 3:
        os.kill(os.getpid(), signal.SIGKILL)
    return square(number)


def process_and_signals(_: int) -> tuple[int, bool]:
    time.sleep(0.2)
    return os.getpid(), signal.SIGINT in signal.pthread_sigmask(signal.SIG_BLOCK, ())


def shared(do, tasks, count=2):
    with Workers(count) as workers:
        return [result for _, result in workers.share_out(do, tasks)]


def test_every_task_is_done_once_by_as_many_processes_that_leave_ctrl_c_alone():
    assert sorted(shared(square, range(10))) == [n * n for n in range(10)]
    seen = shared(process_and_signals, range(8))
    assert len({process for process, _ in seen}) == 2
    assert os.getpid() not in {process for process, _ in seen}
    assert all(blocked for _, blocked in seen)
    assert signal.SIGINT not in signal.pthread_sigmask(signal.SIG_BLOCK, ())


def sleep_and_square(number: int) -> int:
    time.sleep(0.3 if number == 0 else 0.0)
    return square(number)


@pytest.mark.parametrize("count", [1, 2])
def test_results_of_cases_are_in_their_order(count):
    told = []
    with Workers(count) as workers:
        assert workers.try_all(sleep_and_square, 5, told.append) == [n * n for n in range(5)]
    assert told == [0.2, 0.4, 0.6, 0.8, 1.0]


def test_processes_are_kept_for_more_tasks():
    with Workers(2) as workers:
        first = {process for process, _ in workers.try_all(process_and_signals, 4)}
        assert {process for process, _ in workers.try_all(process_and_signals, 4)} == first
    assert not active_children()


def count_of_workers(_: int) -> int:
    return Workers(2).count


def test_a_worker_starts_no_workers_of_its_own():
    assert count_of_workers(0) == 2
    assert shared(count_of_workers, range(2)) == [1, 1]


def threads(_: int) -> int:
    return numba.get_num_threads()


def test_a_worker_keeps_to_one_core():
    assert shared(threads, range(2)) == [1, 1]


def complain(_: int) -> None:
    """Warn of a cell, as its model does whenever it is read."""
    logging.getLogger("vergence.robot").warning("this arm has no meshes")


def test_processes_leave_warnings_to_the_one_that_shares_out_the_tasks(capfd):
    shared(complain, range(4))
    assert capfd.readouterr().err == ""


def test_processes_listen_on_no_port():
    """What they take and run comes by pipes, so that nobody else can send them anything."""
    this = psutil.Process()
    with Workers(2) as workers:
        workers.try_all(square, 4)
        family = [this, *this.children(recursive=True)]
        assert len(family) > 2
        ports = [each for process in family for each in process.net_connections("inet")]
    assert [each for each in ports if each.status == psutil.CONN_LISTEN] == []


def test_the_task_of_a_process_that_dies_is_given_to_another(tmp_path):
    found = sorted(shared(partial(square_once_dead, tmp_path), range(6)))
    assert (tmp_path / "died").exists()
    assert found == [n * n for n in range(6)]


def test_a_task_that_no_process_survives_is_named_and_the_others_end():
    with pytest.raises(DeadlyTaskError, match=f"{DEATHS} processes died over task 3") as error:
        shared(die_at_3, range(6))
    assert error.value.number == 3
    assert not active_children()


def test_what_a_task_raises_is_raised_here_and_the_processes_end():
    with pytest.raises(ValueError, match="-1 is below zero") as error:
        shared(square, [1, -1, 2, 3])
    assert ", in square" in error.value.__notes__[0]  # where it was raised
    assert not active_children()


def test_what_processes_inherit_opens_no_display():
    program = f"import sys, {', '.join(IMPORTED)}; print('mujoco' in sys.modules)"
    said = subprocess.run([sys.executable, "-c", program], check=True, capture_output=True)
    assert said.stdout.strip() == b"False"


def test_processes_end_with_the_iterator():
    with Workers(2) as workers:
        results = workers.share_out(time.sleep, [0.0, 600.0, 600.0])
        next(results)
        began = time.monotonic()
        results.close()
    assert not active_children()
    assert time.monotonic() - began < 60.0


def test_a_run_that_kills_every_process_ends_in_a_clear_message(monkeypatch):
    source = CellSource.of("puma560", {"duration_s": "1.0", "task.feature_count": "4"}, None)
    own = load_cell("puma560").as_tables()["law"]
    trials = [Trial(f"run{n}", {"law": own}) for n in range(2)]

    def deadly(self, do, tasks, spent):
        raise DeadlyTaskError(1)
        yield

    monkeypatch.setattr(Workers, "share_out", deadly)
    with pytest.raises(WorkersLostError, match=f"run run1: every worker .* {DEATHS} in all"):
        list(Executor(workers=2).run(source, trials, 2.0, physics=True))


def descendants(process: int) -> list[int]:
    try:
        own = Path(f"/proc/{process}/task/{process}/children").read_text().split()
    except FileNotFoundError:
        return []
    return [one for child in map(int, own) for one in (child, *descendants(child))]


ENDLESS = """
import sys, time
from vergence.experiments.workers import Workers
if __name__ == "__main__":
    with Workers(2) as workers:
        for _ in workers.share_out(time.sleep, [0.0, 600.0, 600.0]):
            print("one is done", flush=True)
"""


def test_ctrl_c_ends_all_processes_without_a_word_from_them(tmp_path):
    script = tmp_path / "endless.py"
    script.write_text(ENDLESS)
    running = subprocess.Popen(
        [sys.executable, str(script)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        start_new_session=True,
    )  # fmt: skip
    assert running.stdout is not None
    assert running.stdout.readline() == "one is done\n"  # and the others have been begun
    workers = descendants(running.pid)
    assert len(workers) == 4  # two, what forks them, and a tracker of resources
    os.killpg(running.pid, signal.SIGINT)
    _, said = running.communicate(timeout=60)
    assert said.count("Traceback") == 1  # of the script itself
    assert "KeyboardInterrupt" in said
    deadline = time.monotonic() + 60.0
    while any(Path(f"/proc/{worker}").exists() for worker in workers):
        assert time.monotonic() < deadline
        time.sleep(0.05)


PROGRAM = """
import os, time
from pathlib import Path
from vergence.experiments.workers import Workers

def case(number):
    Path(f"{number}.pid").write_text(str(os.getpid()))
    time.sleep(600.0)

if __name__ == "__main__":
    with Workers(2) as workers:
        workers.try_all(case, 4)
"""


def wait_until(holds, seconds: float) -> bool:  # type: ignore[no-untyped-def]
    end = time.monotonic() + seconds
    while not holds():
        if time.monotonic() > end:
            return False
        time.sleep(0.05)
    return True


def is_alive(pid: int) -> bool:
    try:
        state = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
    except FileNotFoundError:
        return False
    return state != "Z"  # nobody has asked how it ended


@pytest.mark.parametrize("how", [signal.SIGKILL, signal.SIGTERM])
def test_workers_end_with_a_killed_parent(tmp_path: Path, how: signal.Signals) -> None:
    (tmp_path / "study.py").write_text(PROGRAM)
    parent = subprocess.Popen([sys.executable, "study.py"], cwd=tmp_path)
    try:
        assert wait_until(lambda: len(list(tmp_path.glob("*.pid"))) == 2, 60.0)
        time.sleep(0.2)
        workers = [int(file.read_text()) for file in tmp_path.glob("*.pid")]
        assert all(map(is_alive, workers))
    finally:
        os.kill(parent.pid, how)
        parent.wait(30.0)
    assert wait_until(lambda: not any(map(is_alive, workers)), 20.0)
